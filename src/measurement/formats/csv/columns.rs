//! What the columns of a table are: by their names, by what stands in them, or as the user says.

use super::names::{Deviation, Role, exact_role, role};
use super::number::{is_missing, number};
use crate::error::{Error, OptionName, Place, excerpt, short};
use crate::measurement::Channel;
use crate::measurement::reading::{Angle, AngleUnit, AngleUnits, ColumnChoice};
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// The columns of angles that this project writes, in degrees.
pub const ANGLES: [&str; 4] = ["theta_i", "phi_i", "theta_o", "phi_o"];

/// The comment before the header of a table of this project in which names that usually say something else are those of channels.
pub(super) const EXACT: &str = "# brdfit: every other column is a channel";

/// Wavelengths below this, all of them, are micrometres: no instrument for reflectance goes below 100 nm, and none has a channel above.
pub(super) const LARGEST_MICROMETRES: f64 = 100.0;
/// In so many rows a first column that counts up is taken for row numbers.
const ROWS_COUNTED: usize = 10;

/// Why a header cannot be understood.
#[derive(Debug)]
pub struct BadHeader {
    /// What a header must have.
    pub expected: String,
    /// What it has.
    pub found: String,
    /// An option that would say what is meant, and a value for it.
    pub hint: Option<(OptionName, String)>,
}

impl BadHeader {
    fn new(expected: impl Into<String>, found: impl Into<String>) -> Self {
        Self { expected: expected.into(), found: found.into(), hint: None }
    }

    /// The error for the file with this header.
    pub(super) fn in_file(self, path: &Path, place: Place) -> Error {
        let error = Error::malformed(path, place, self.expected, self.found);
        match self.hint {
            Some((option, value)) => error.with_hint(option, value),
            None => error,
        }
    }

    fn with_hint(self, value: impl Into<String>) -> Self {
        Self { hint: Some((OptionName::Columns, value.into())), ..self }
    }
}

/// A column of angles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AngleColumn {
    /// Its place in a row, from 0.
    pub column: usize,
    /// The unit of its numbers.
    pub unit: AngleUnit,
}

/// A column of standard deviations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeviationColumn {
    /// Its place in a row, from 0.
    pub column: usize,
    /// Standard deviations per unit of its numbers.
    pub factor: f64,
    /// Whether its numbers are relative to the value.
    pub relative: bool,
}

/// The column of wavelengths, in a table with a row for each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WavelengthColumn {
    /// Its place in a row, from 0.
    pub column: usize,
    /// Nanometres per unit; `None` if the header does not say.
    pub nanometres: Option<f64>,
}

/// The columns of directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AngleColumns {
    /// The polar angle of the light.
    pub theta_i: AngleColumn,
    /// The polar angle of the viewer.
    pub theta_o: AngleColumn,
    /// The azimuth of the light; `None` for 0.
    pub phi_i: Option<AngleColumn>,
    /// The azimuth of the viewer, from the same axis; `None` if there is none.
    pub phi_o: Option<AngleColumn>,
    /// The azimuth between both; `None` if there is none, or if it is not needed.
    pub phi: Option<AngleColumn>,
}

impl AngleColumns {
    /// The columns with the angles that they hold, those that exist.
    pub(super) fn all(&self) -> impl Iterator<Item = (Angle, AngleColumn)> {
        let found = [
            (Angle::ThetaI, Some(self.theta_i)),
            (Angle::PhiI, self.phi_i),
            (Angle::ThetaO, Some(self.theta_o)),
            (Angle::PhiO, self.phi_o),
            (Angle::Phi, self.phi),
        ];
        found.into_iter().filter_map(|(angle, column)| Some((angle, column?)))
    }
}

/// The contents of each column.
#[derive(Clone, Debug)]
pub struct Columns {
    /// The columns of directions.
    pub angles: AngleColumns,
    /// The channels, in the order of their columns. In a table with a row for each wavelength, these are the columns of values.
    pub channels: Vec<Channel>,
    /// The column of each channel's values.
    pub values: Vec<usize>,
    /// The column of each channel's standard deviations; `None` if there is none.
    pub sigma: Vec<Option<DeviationColumn>>,
    /// The column of wavelengths, in a table with a row for each.
    pub wavelength: Option<WavelengthColumn>,
    /// What was made of the columns, in words; `None` if their names are those that this project writes.
    pub said: Option<String>,
    /// The columns whose names say that their values are not f, and what they are instead.
    pub doubts: Vec<(String, &'static str)>,
}

/// What is known about a table before its columns are understood.
pub struct Header<'a> {
    /// The names of the columns.
    pub names: &'a [String],
    /// The fields of the first rows.
    pub rows: &'a [Vec<String>],
    /// The unit of each column, from a line of units; empty if there is none.
    pub units: &'a [String],
    /// The header as it stands in the file; empty if it is not known.
    pub text: &'a str,
    /// Whether the table says that every column beside the angles is a channel, as [`EXACT`].
    pub is_exact: bool,
}

impl<'a> Header<'a> {
    /// Names alone.
    pub fn of(names: &'a [String]) -> Self {
        Self { names, rows: &[], units: &[], text: "", is_exact: false }
    }

    /// The roles of the columns by their names.
    fn roles(&self) -> Vec<Role> {
        let role = if self.is_exact { exact_role } else { role };
        self.names.iter().map(|name| role(name)).collect()
    }

    /// The fields of a column in the first rows.
    fn fields(&self, column: usize) -> impl Iterator<Item = &str> {
        self.rows.iter().map(move |row| row.get(column).map(String::as_str).unwrap_or_default())
    }

    /// Whether a column counts up by one from row to row, over enough rows.
    fn counts_up(&self, column: usize) -> bool {
        let counted: Vec<Option<f64>> = self.fields(column).map(|field| number(field, false)).collect();
        counted.len() >= ROWS_COUNTED
            && counted.windows(2).all(|pair| matches!(pair, [Some(a), Some(b)] if (b - a - 1.0).abs() < 1e-9))
            && matches!(counted.first(), Some(Some(first)) if *first == 0.0 || *first == 1.0)
    }

    /// Whether a column has text in all of several rows.
    fn is_text(&self, column: usize) -> bool {
        let text = |field: &str| number(field, true).is_none() && !is_missing(field) && !is_infinite(field);
        self.rows.len() > 1 && self.fields(column).all(text)
    }

    fn is_blank(&self, column: usize) -> bool {
        self.fields(column).all(str::is_empty)
    }

    /// The names for a message.
    fn listed(&self) -> String {
        if self.text.is_empty() { excerpt(&self.names.join(",")) } else { excerpt(self.text) }
    }
}

/// Whether a field says infinity, which is not text but a fault.
fn is_infinite(field: &str) -> bool {
    field.parse().is_ok_and(f64::is_infinite) || field.contains('∞') || field.to_lowercase().contains("#inf")
}

/// The roles of the columns, and what was made of them.
struct Roles<'a> {
    header: &'a Header<'a>,
    roles: Vec<Role>,
    /// Whether a role was chosen, by name or by the user, so that contents cannot change it.
    chosen: Vec<bool>,
}

impl<'a> Roles<'a> {
    fn new(header: &'a Header<'a>, choice: &ColumnChoice) -> Result<Self, BadHeader> {
        let names = header.names;
        // A set, because a header may be as wide as a file is long.
        let mut seen = HashSet::new();
        for name in names.iter().filter(|name| !name.is_empty()) {
            if !seen.insert(name) {
                return Err(BadHeader::new("column names that differ", format!("{} twice", excerpt(name))));
            }
            if name.contains(char::is_control) {
                return Err(BadHeader::new("column names without control characters", excerpt(name)));
            }
        }
        let mut roles = Self { header, roles: header.roles(), chosen: vec![false; names.len()] };
        roles.choose(choice)?;
        roles.look_inside()?;
        Ok(roles)
    }

    /// The place of a column that the user names, by its name or by its number from 1.
    fn place(&self, column: &str) -> Result<usize, BadHeader> {
        let names = self.header.names;
        let exact = names.iter().position(|name| name == column);
        let any_case = || names.iter().position(|name| name.to_lowercase() == column.to_lowercase());
        let numbered = || {
            let place = column.trim_start_matches('#').parse::<usize>().ok()?.checked_sub(1)?;
            (place < names.len()).then_some(place)
        };
        exact.or_else(any_case).or_else(numbered).ok_or_else(|| {
            BadHeader::new(
                format!("a column {} (the option {} names it)", excerpt(column), OptionName::Columns),
                self.header.listed(),
            )
        })
    }

    fn set(&mut self, column: &str, role: Role) -> Result<(), BadHeader> {
        let place = self.place(column)?;
        if let (Some(known), Some(chosen)) = (self.roles.get_mut(place), self.chosen.get_mut(place)) {
            if std::mem::replace(chosen, true) {
                return Err(BadHeader::new(
                    format!("one part for each column (the option {})", OptionName::Columns),
                    format!("two for {}", excerpt(column)),
                ));
            }
            *known = role;
        }
        Ok(())
    }

    /// Gives columns the roles that the user chose.
    fn choose(&mut self, choice: &ColumnChoice) -> Result<(), BadHeader> {
        for (angle, column) in &choice.angles {
            // Another column that looks like this angle is none.
            for (role, name) in self.roles.iter_mut().zip(self.header.names) {
                if matches!(role, Role::Angle(known, _) if known == angle) && name != column {
                    *role = Role::Other("another column was chosen");
                }
            }
            let place = self.place(column)?;
            let unit = match self.header.names.get(place).map(|name| role(name)) {
                Some(Role::Angle(_, unit) | Role::OtherPolarAngle(unit)) => unit,
                _ => None,
            };
            self.set(column, Role::Angle(*angle, unit))?;
        }
        if let Some(column) = &choice.wavelength {
            let place = self.place(column)?;
            let unit = match self.header.names.get(place).map(|name| role(name)) {
                Some(Role::Wavelength(unit)) => unit,
                _ => None,
            };
            self.set(column, Role::Wavelength(unit))?;
        }
        if !choice.channels.is_empty() {
            for role in &mut self.roles {
                if matches!(role, Role::Value { .. }) {
                    *role = Role::Other("not chosen");
                }
            }
        }
        for column in &choice.channels {
            let place = self.place(column)?;
            let name = self.header.names.get(place).map(String::as_str).unwrap_or_default();
            let value = match role(name) {
                value @ Role::Value { .. } => value,
                _ => Role::Value { channel: Channel::named(name), doubt: None },
            };
            self.set(column, value)?;
        }
        if !choice.sigma.is_empty() {
            for role in &mut self.roles {
                if matches!(role, Role::Deviation(_)) {
                    *role = Role::Other("not chosen");
                }
            }
        }
        for column in &choice.sigma {
            let place = self.place(column)?;
            let known = self.header.names.get(place).map(|name| role(name));
            let deviation = match known {
                Some(Role::Deviation(deviation)) => deviation,
                _ => Deviation { of: None, certain: true, factor: 1.0, relative: false },
            };
            self.set(column, Role::Deviation(deviation))?;
        }
        for column in &choice.ignore {
            self.set(column, Role::Other("as asked"))?;
        }
        Ok(())
    }

    /// Finds columns that are no values by what stands in them.
    fn look_inside(&mut self) -> Result<(), BadHeader> {
        let header = self.header;
        for (column, ((role, name), chosen)) in
            self.roles.iter_mut().zip(header.names).zip(&self.chosen).enumerate()
        {
            if *chosen || header.is_exact || !matches!(role, Role::Value { .. }) {
                if name.is_empty() && header.is_exact {
                    return Err(BadHeader::new(
                        "a name for every column",
                        format!("none for column {}", column + 1),
                    ));
                }
                continue;
            }
            if column == 0 && header.counts_up(column) {
                *role = Role::Other("row numbers");
            } else if name.is_empty() {
                if header.rows.is_empty() || !header.is_blank(column) {
                    let found = format!("none for column {}", column + 1);
                    return Err(BadHeader::new("a name for every column", found)
                        .with_hint(format!("ignore={}", column + 1)));
                }
                *role = Role::Other("empty");
            } else if header.is_text(column) {
                *role = Role::Other("text");
            }
        }
        Ok(())
    }

    /// Decides for `theta_s` and the like which polar angle they are.
    fn settle_polar_angles(&mut self) {
        let has = |roles: &[Role], wanted: Angle| {
            roles.iter().any(|role| matches!(role, Role::Angle(angle, _) if *angle == wanted))
        };
        let has_light = has(&self.roles, Angle::ThetaI);
        let has_viewer = has(&self.roles, Angle::ThetaO);
        for role in &mut self.roles {
            if let Role::OtherPolarAngle(unit) = role {
                *role = match (has_light, has_viewer) {
                    (true, false) => Role::Angle(Angle::ThetaO, *unit),
                    (false, true) => Role::Angle(Angle::ThetaI, *unit),
                    _ => Role::Other("a polar angle of neither light nor viewer"),
                };
            }
        }
    }

    /// The column of an angle.
    fn angle(&self, wanted: Angle, units: &AngleUnits) -> Result<Option<AngleColumn>, BadHeader> {
        let of_role = |(column, role): (usize, &Role)| match role {
            Role::Angle(angle, unit) if *angle == wanted => Some((column, *unit)),
            _ => None,
        };
        let found: Vec<(usize, Option<AngleUnit>)> =
            self.roles.iter().enumerate().filter_map(of_role).collect();
        let name = |column: usize| self.header.names.get(column).map(String::as_str).unwrap_or_default();
        let exact = found.iter().find(|(column, _)| name(*column) == wanted.name());
        let (column, unit) = match (found.as_slice(), exact) {
            ([], _) => return Ok(None),
            ([only], _) => *only,
            (_, Some(exact)) => *exact,
            ([first, second, ..], None) => {
                let found = format!("{} and {}", excerpt(name(first.0)), excerpt(name(second.0)));
                return Err(BadHeader::new(format!("one column for {}", wanted.name()), found)
                    .with_hint(format!("{}={}", wanted.name(), short(name(first.0)))));
            }
        };
        let by_line = || {
            let name =
                format!("theta_i [{}]", self.header.units.get(column)?.trim_matches(['[', ']', '(', ')']));
            match role(&name) {
                Role::Angle(_, unit) => unit,
                _ => None,
            }
        };
        let unit = units.of(wanted).or(unit).or_else(by_line).unwrap_or_default();
        Ok(Some(AngleColumn { column, unit }))
    }

    fn angles(&mut self, units: &AngleUnits) -> Result<AngleColumns, BadHeader> {
        self.settle_polar_angles();
        let needed = |angle: Angle| {
            let missing = BadHeader::new(
                format!("a header with a column '{}' or another name of it", angle.name()),
                self.header.listed(),
            );
            let hint = format!("{}=COLUMN", angle.name());
            self.angle(angle, units)?.ok_or_else(|| missing.with_hint(hint))
        };
        let (theta_i, theta_o) = (needed(Angle::ThetaI)?, needed(Angle::ThetaO)?);
        let phi_i = self.angle(Angle::PhiI, units)?;
        let phi_o = self.angle(Angle::PhiO, units)?;
        let phi = self.angle(Angle::Phi, units)?;
        if let (None, Some(phi_o), Some(phi)) = (phi_i, phi_o, phi) {
            let name = |column: AngleColumn| {
                excerpt(self.header.names.get(column.column).map(String::as_str).unwrap_or_default())
            };
            let found = format!("{} and {}", name(phi), name(phi_o));
            let hint = format!("phi_i={}", short(name(phi).trim_matches('\'')));
            return Err(BadHeader::new("one azimuth of the viewer, or that of the light as well", found)
                .with_hint(hint));
        }
        // With both azimuths the one between them says nothing new.
        let phi = phi.filter(|_| phi_i.is_none() || phi_o.is_none());
        Ok(AngleColumns { theta_i, theta_o, phi_i, phi_o: phi_o.filter(|_| phi.is_none()), phi })
    }
}

impl Columns {
    /// Finds the angles in a header that may contain anything else.
    ///
    /// # Errors
    /// What was expected and what was found.
    pub fn angles(
        header: &Header<'_>,
        choice: &ColumnChoice,
        units: &AngleUnits,
    ) -> Result<AngleColumns, BadHeader> {
        // A name that is given twice, or none, does not matter here.
        let mut roles = Roles { header, roles: header.roles(), chosen: vec![false; header.names.len()] };
        roles.choose(&ColumnChoice { angles: choice.angles.clone(), ..ColumnChoice::default() })?;
        roles.angles(units)
    }

    /// Understands a header.
    ///
    /// # Errors
    /// What was expected and what was found.
    pub fn parse(header: &Header<'_>, choice: &ColumnChoice, units: &AngleUnits) -> Result<Self, BadHeader> {
        let mut roles = Roles::new(header, choice)?;
        let angles = roles.angles(units)?;
        let wavelength = wavelength(&roles)?;
        let Values { channels, values, doubts, micrometres } = values(&roles)?;
        let (sigma, unused) = sigma(&roles, &channels, choice)?;
        let mut columns = Self { angles, channels, values, sigma, wavelength, said: None, doubts };
        columns.said = said(&roles, &columns, &unused, micrometres);
        Ok(columns)
    }
}

/// The channels that the names of a header tell; `None` if a reader would not understand it. `is_exact` is whether every other column is
/// said to be a channel.
pub(super) fn channels_of(names: &[String], is_exact: bool) -> Option<Vec<Channel>> {
    let header = Header { is_exact, ..Header::of(names) };
    let columns = Columns::parse(&header, &ColumnChoice::default(), &AngleUnits::default()).ok()?;
    columns.wavelength.is_none().then_some(columns.channels)
}

/// The column of wavelengths.
fn wavelength(roles: &Roles<'_>) -> Result<Option<WavelengthColumn>, BadHeader> {
    let by_line = |column: usize| {
        let unit = roles.header.units.get(column)?.trim_matches(['[', ']', '(', ')']);
        match role(&format!("wavelength [{unit}]")) {
            Role::Wavelength(nanometres) => nanometres,
            _ => None,
        }
    };
    let of_role = |(column, role): (usize, &Role)| match role {
        Role::Wavelength(nanometres) => {
            Some(WavelengthColumn { column, nanometres: nanometres.or_else(|| by_line(column)) })
        }
        _ => None,
    };
    let found: Vec<WavelengthColumn> = roles.roles.iter().enumerate().filter_map(of_role).collect();
    match found.as_slice() {
        [] => Ok(None),
        [only] => Ok(Some(*only)),
        [first, second, ..] => {
            let name = |column: &WavelengthColumn| {
                excerpt(roles.header.names.get(column.column).map(String::as_str).unwrap_or_default())
            };
            let found = format!("{} and {}", name(first), name(second));
            Err(BadHeader::new("one column of wavelengths", found).with_hint("wavelength=COLUMN"))
        }
    }
}

/// The columns of values.
struct Values {
    channels: Vec<Channel>,
    values: Vec<usize>,
    doubts: Vec<(String, &'static str)>,
    /// Whether the names are wavelengths in micrometres.
    micrometres: bool,
}

fn values(roles: &Roles<'_>) -> Result<Values, BadHeader> {
    let names = roles.header.names;
    let mut found =
        Values { channels: Vec::new(), values: Vec::new(), doubts: Vec::new(), micrometres: false };
    for (column, (role, name)) in roles.roles.iter().zip(names).enumerate() {
        let Role::Value { channel, doubt } = role else { continue };
        found.channels.push(channel.clone());
        found.values.push(column);
        found.doubts.extend(doubt.map(|what| (name.clone(), what)));
        let by_line = roles.header.units.get(column).map(|unit| unit.trim_matches(['[', ']', '(', ')']));
        let by_line = by_line.and_then(|unit| match self::role(&format!("f [{unit}]")) {
            Role::Value { doubt, .. } => doubt,
            _ => None,
        });
        found.doubts.extend(by_line.map(|what| (name.clone(), what)));
    }
    if found.channels.is_empty() {
        return Err(BadHeader::new("a column of values beside the angles", roles.header.listed())
            .with_hint("channels=COLUMN"));
    }
    // Bare numbers that are too small to be nanometres.
    let is_bare = |column: &usize| names.get(*column).is_some_and(|name| name.parse::<f64>().is_ok());
    let small = |channel: &Channel| channel.wavelength_nm.is_some_and(|nm| nm < LARGEST_MICROMETRES);
    found.micrometres =
        !roles.header.is_exact && found.values.iter().all(is_bare) && found.channels.iter().all(small);
    if found.micrometres {
        let in_nanometres = |channel: &Channel| {
            Channel::at_wavelength(super::names::wavelength(channel.wavelength_nm.unwrap_or_default(), 1e3))
        };
        found.channels = found.channels.iter().map(in_nanometres).collect();
    }
    let mut seen = HashSet::new();
    for (channel, column) in found.channels.iter().zip(&found.values) {
        if channel.name.is_empty() || !seen.insert(&channel.name) {
            let name = names.get(*column).map(String::as_str).unwrap_or_default();
            return Err(BadHeader::new("channels that differ", format!("{} twice", excerpt(name))));
        }
    }
    Ok(found)
}

/// The column of each channel's standard deviations, and the columns of others, which are left out.
fn sigma(
    roles: &Roles<'_>,
    channels: &[Channel],
    choice: &ColumnChoice,
) -> Result<(Vec<Option<DeviationColumn>>, Vec<usize>), BadHeader> {
    let column_of = |column: usize, deviation: &Deviation| DeviationColumn {
        column,
        factor: deviation.factor,
        relative: deviation.relative,
    };
    let deviations = roles.roles.iter().enumerate().filter_map(|(column, role)| match role {
        Role::Deviation(deviation) => Some((column, deviation)),
        _ => None,
    });
    if choice.sigma.len() > 1 {
        if choice.sigma.len() != channels.len() {
            let expected = format!(
                "one column of standard deviations, or one for each of {} channels (the option {})",
                channels.len(),
                OptionName::Columns
            );
            return Err(BadHeader::new(expected, choice.sigma.len().to_string()));
        }
        let all: HashMap<usize, &Deviation> = deviations.collect();
        let of_channel = |column: &String| {
            let place = roles.place(column)?;
            Ok(all.get(&place).map(|deviation| column_of(place, deviation)))
        };
        return Ok((choice.sigma.iter().map(of_channel).collect::<Result<_, _>>()?, Vec::new()));
    }
    let places: HashMap<&str, usize> =
        channels.iter().enumerate().map(|(place, channel)| (channel.name.as_str(), place)).collect();
    let mut of_all = None;
    let mut of_channel: Vec<Option<DeviationColumn>> = vec![None; channels.len()];
    let mut unused = Vec::new();
    for (column, deviation) in deviations {
        let Some(of) = deviation.of.as_ref().filter(|_| choice.sigma.is_empty()) else {
            if of_all.is_none() {
                of_all = Some(column_of(column, deviation));
            } else {
                unused.push(column);
            }
            continue;
        };
        let by_role = || match role(of) {
            Role::Value { channel, .. } => places.get(channel.name.as_str()).copied(),
            _ => None,
        };
        let place = places.get(Channel::named(of).name.as_str()).copied().or_else(by_role);
        // With a single channel the name of the quantity may stand for it.
        let of_quantity = || {
            let quantity = ["f", "fr", "brdf", "bsdf", "brf", "value", "reflectance"]
                .contains(&of.to_lowercase().as_str());
            (channels.len() == 1 && quantity).then_some(0)
        };
        match place.or_else(of_quantity).and_then(|place| of_channel.get_mut(place)) {
            // If one wavelength is spelled in several ways, the first one counts.
            Some(known) if known.is_none() => *known = Some(column_of(column, deviation)),
            Some(_) => unused.push(column),
            None if deviation.certain => {
                let name = roles.header.names.get(column).map(String::as_str).unwrap_or_default();
                let expected = format!("a column {} beside {}", excerpt(of), excerpt(name));
                return Err(BadHeader::new(expected, roles.header.listed()));
            }
            None => unused.push(column),
        }
    }
    Ok((of_channel.into_iter().map(|own| own.or(of_all)).collect(), unused))
}

/// What was made of the columns, in words. `None` if there is nothing to say: the names are those that this project writes.
fn said(roles: &Roles<'_>, columns: &Columns, unused: &[usize], micrometres: bool) -> Option<String> {
    let names = roles.header.names;
    let name = |column: usize| excerpt(names.get(column).map(String::as_str).unwrap_or_default());
    let mut parts = Vec::new();
    let mut is_plain = columns.wavelength.is_none() && !micrometres && unused.is_empty();
    is_plain &= columns.angles.all().count() == ANGLES.len();
    for (angle, AngleColumn { column, unit }) in columns.angles.all() {
        is_plain &= names.get(column).is_some_and(|name| name == angle.name()) && unit == AngleUnit::Degrees;
        parts.push(format!("{} {} ({})", angle.name(), name(column), unit.name()));
    }
    let channel_names: Vec<String> = columns.values.iter().take(8).map(|column| name(*column)).collect();
    let more = columns.values.len().saturating_sub(channel_names.len());
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    let in_micrometres = if micrometres { ", wavelengths in micrometres" } else { "" };
    parts.push(format!("values {}{more}{in_micrometres}", channel_names.join(" ")));
    if let Some(WavelengthColumn { column, .. }) = columns.wavelength {
        parts.push(format!("wavelength {}", name(column)));
    }
    let mut deviations: Vec<DeviationColumn> = columns.sigma.iter().flatten().copied().collect();
    deviations.dedup();
    for DeviationColumn { column, factor, relative } in deviations.iter().take(8) {
        let written = names.get(*column).map(String::as_str).unwrap_or_default();
        is_plain &= written.starts_with("sigma") && *factor == 1.0 && !relative;
        let relative = if *relative { ", relative to the value" } else { "" };
        let factor = if *factor == 1.0 { String::new() } else { format!(", times {factor}") };
        parts.push(format!("standard deviation {}{relative}{factor}", name(*column)));
    }
    let used: HashSet<usize> = columns.angles.all().map(|(_, column)| column.column).collect();
    let mut left_out = Vec::new();
    for (column, role) in roles.roles.iter().enumerate() {
        let why = match role {
            Role::Other(why) => *why,
            Role::Angle(..) if !used.contains(&column) => "an angle that the others give",
            Role::Deviation(_) if unused.contains(&column) => "standard deviations of no channel",
            _ => continue,
        };
        is_plain = false;
        left_out.push(format!("{} ({why})", name(column)));
    }
    if !left_out.is_empty() {
        let more = left_out.len().saturating_sub(8);
        left_out.truncate(8);
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        parts.push(format!("left out {}{more}", left_out.join(" ")));
    }
    (!is_plain).then(|| parts.join(", "))
}
