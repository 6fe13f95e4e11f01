//! The parameters of an expression for given channels: their values, their bounds, and which of them the fit moves.

use super::constraints::check_contradictions;
use super::row::{ParameterRow, ParameterValue, Status};
use super::selector::{Selector, Setting, Settings, channel_suffix, resolve};
use crate::error::{Error, OptionName, Subject};
use crate::geometry::Azimuths;
use crate::model::{Expression, Isotropy, Lobe, LobeValues, ParamSpec, Role, Scale, Sharing, Strength};

/// Values closer than this, as a ratio or as a fraction of the typical range, belong to the same minimum.
const SAME_VALUE: f64 = 0.05;

/// Every parameter of a model, and which of them are free.
#[derive(Clone, Debug)]
pub struct ParameterTable {
    pub(super) lobes: Vec<String>,
    /// The model of each lobe, with every choice spelled out.
    pub(super) kinds: Vec<String>,
    pub(super) channels: Vec<String>,
    pub(super) rows: Vec<ParameterRow>,
    /// The row of each channel, by lobe and parameter; a single row for a shared parameter.
    pub(super) places: Vec<Vec<Vec<usize>>>,
    /// Rows of the free parameters, in order.
    pub(super) free: Vec<usize>,
    pub(super) products: Vec<Product>,
    /// How each lobe can be absent.
    pub(super) strengths: Vec<Strength>,
    /// What the data tell about the azimuth of the half vector.
    azimuths: Azimuths,
    /// Whether each channel is dead.
    pub(super) dead: Vec<bool>,
}

/// Two parameters of a lobe whose product is determined better than either of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Product {
    /// Index of the lobe in the expression.
    pub lobe: usize,
    /// Index of one factor in the lobe's declaration.
    pub first: usize,
    /// Index of the other factor.
    pub second: usize,
}

impl ParameterTable {
    /// Creates the table of the parameters of `expression` for `channels`, with the constraints inside it and in `settings`. What
    /// `azimuths` cannot tell is held at the value that leaves the model isotropic.
    ///
    /// # Errors
    /// [`Error::UnknownName`] for a setting that names nothing, [`Error::Invalid`] for one that does not suit the
    /// model.
    pub fn new(
        expression: &Expression,
        channels: &[String],
        azimuths: Azimuths,
        settings: &Settings,
    ) -> Result<Self, Error> {
        let settings = &[expression.settings()?, settings.clone()].concat();
        check_contradictions(expression, settings, channels)?;
        let lobes: Vec<String> = expression.lobes().iter().map(|lobe| lobe.name.clone()).collect();
        let mut specs: Vec<Vec<ParamSpec>> = expression.lobes().iter().map(Lobe::parameters).collect();
        for (selector, setting) in settings {
            let sharing = match setting {
                Setting::PerChannel => Sharing::PerChannel,
                Setting::Shared => Sharing::Shared,
                _ => continue,
            };
            let (lobe, name, channel) = resolve(selector, &lobes, &specs, channels)?;
            if channel.is_some() {
                return Err(Error::invalid(
                    selector.to_string(),
                    "a name without a channel",
                    "one with a channel",
                ));
            }
            for (index, lobe_specs) in specs.iter_mut().enumerate() {
                for spec in
                    lobe_specs.iter_mut().filter(|s| s.name == name && lobe.is_none_or(|l| l == index))
                {
                    spec.sharing = sharing;
                }
            }
        }

        let mut table = Self {
            lobes,
            kinds: expression.lobes().iter().map(Lobe::canonical).collect(),
            channels: channels.to_vec(),
            rows: Vec::new(),
            places: Vec::new(),
            free: Vec::new(),
            products: products(expression, &specs),
            strengths: expression.lobes().iter().map(Lobe::strength).collect(),
            azimuths,
            dead: vec![false; channels.len()],
        };
        for (lobe, lobe_specs) in specs.iter().enumerate() {
            let mut places = Vec::new();
            for (parameter, spec) in lobe_specs.iter().enumerate() {
                let first = table.rows.len();
                let per_row: Vec<Option<usize>> = match spec.sharing {
                    Sharing::Shared => vec![None],
                    Sharing::PerChannel => (0..channels.len()).map(Some).collect(),
                };
                table.rows.extend(per_row.into_iter().map(|channel| ParameterRow {
                    lobe,
                    parameter,
                    spec: spec.clone(),
                    channel,
                    value: spec.initial,
                    initial: spec.initial,
                    given: false,
                    bounds: spec.bounds,
                    status: if spec.fixed { Status::Fixed } else { Status::Free },
                    held: false,
                    overruled: false,
                }));
                places.push((first..table.rows.len()).collect());
            }
            table.places.push(places);
        }
        table.free_scales_of_several();
        table.hold_isotropic(settings, &specs)?;
        for (selector, setting) in settings {
            table.apply(selector, setting, &specs)?;
        }
        table.finish()?;
        Ok(table)
    }

    /// Holds the parameters that make a model anisotropic at the values at which it is isotropic, as far as the data cannot tell. A
    /// value that the user gives stands, and where the data tell at least a little, so does the wish to fit it.
    fn hold_isotropic(&mut self, settings: &Settings, specs: &[Vec<ParamSpec>]) -> Result<(), Error> {
        let may_fit = match self.azimuths {
            Azimuths::Several => return Ok(()),
            Azimuths::OnePlane => true,
            Azimuths::Lost => false,
        };
        let mut decided: Vec<usize> = Vec::new();
        for (selector, setting) in settings {
            let decides = match setting {
                Setting::Fix(_) | Setting::Set(_) => true,
                Setting::Free => may_fit,
                _ => false,
            };
            if decides {
                decided.extend(self.matching(selector, specs)?);
            }
        }
        for index in (0..self.rows.len()).filter(|index| !decided.contains(index)) {
            let row = &self.rows[index];
            let Some(isotropy) = row.spec.isotropy else { continue };
            let status = match isotropy {
                Isotropy::At(_) => Status::Fixed,
                Isotropy::As(other) => {
                    let is_other = |r: &ParameterRow| {
                        (r.lobe, r.spec.name) == (row.lobe, other)
                            && (r.channel == row.channel || r.channel.is_none())
                    };
                    let Some(target) = self.rows.iter().position(is_other) else { continue };
                    Status::Tied(target)
                }
            };
            let row = &mut self.rows[index];
            (row.status, row.held) = (status, true);
            if let Isotropy::At(value) = isotropy {
                row.value = value;
            }
        }
        Ok(())
    }

    /// Applies one setting.
    fn apply(
        &mut self,
        selector: &Selector,
        setting: &Setting,
        specs: &[Vec<ParamSpec>],
    ) -> Result<(), Error> {
        let rows = self.matching(selector, specs)?;
        if let Setting::Tie(other) = setting {
            let targets = self.matching(other, specs)?;
            // `kd=kd.r` ties the other channels to red.
            let rows: Vec<usize> = match targets.as_slice() {
                [only] if rows.len() > 1 => rows.into_iter().filter(|row| row != only).collect(),
                _ => rows,
            };
            return self.tie(selector, other, &rows, &targets);
        }
        for index in rows {
            let row = &mut self.rows[index];
            match *setting {
                Setting::Free | Setting::Init(_) | Setting::Bounds(..) if row.held => row.overruled = true,
                Setting::Fix(value) => {
                    row.value = value;
                    row.given = true;
                    row.status = Status::Fixed;
                }
                Setting::Init(value) | Setting::Set(value) => {
                    row.value = value;
                    row.given = true;
                }
                Setting::Bounds(lower, upper) => row.bounds = (lower, upper),
                Setting::Free => row.status = Status::Free,
                Setting::Tie(_) | Setting::PerChannel | Setting::Shared => {}
            }
        }
        Ok(())
    }

    /// Ties `rows`, which `selector` names, to `targets`, which `other` names.
    fn tie(
        &mut self,
        selector: &Selector,
        other: &Selector,
        rows: &[usize],
        targets: &[usize],
    ) -> Result<(), Error> {
        for &index in rows {
            let channel = self.rows[index].channel;
            let same_channel = |target: &&usize| {
                let of_target = self.rows[**target].channel;
                of_target == channel || of_target.is_none()
            };
            // Every channel may follow a single shared value; otherwise each channel follows the same channel.
            let target = match targets {
                [only] => Some(*only),
                several => several.iter().find(same_channel).copied(),
            };
            match target {
                Some(target) if target != index => self.rows[index].status = Status::Tied(target),
                other_row => {
                    return Err(Error::invalid(
                        Subject::OptionOf(OptionName::Tie, format!("{selector}={other}")),
                        "another parameter with the same channels",
                        if other_row.is_some() { "the same parameter" } else { "other channels" },
                    ));
                }
            }
        }
        Ok(())
    }

    /// Checks values against bounds and ties against each other, and lists the free rows.
    fn finish(&mut self) -> Result<(), Error> {
        (0..self.rows.len()).try_for_each(|index| self.check_row(index))?;
        self.resolve_ties()?;
        self.narrow_tied()?;
        for row in &mut self.rows {
            row.value = row.value.clamp(row.bounds.0, row.bounds.1);
            row.initial = row.value;
        }
        self.list_free();
        self.follow();
        Ok(())
    }

    /// Checks the bounds of a row, and the value that the user gave against them.
    fn check_row(&self, index: usize) -> Result<(), Error> {
        let row = &self.rows[index];
        let (lower, upper) = row.bounds;
        let bounds = || Subject::OptionOf(OptionName::Bounds, self.name(index));
        if lower.partial_cmp(&upper) != Some(std::cmp::Ordering::Less) {
            let expected = "the lower bound below the upper";
            return Err(Error::invalid(bounds(), expected, format!("{lower}..{upper}")));
        }
        if row.spec.scale == Scale::Square && lower < 0.0 {
            return Err(Error::invalid(bounds(), "a lower bound of at least 0", lower.to_string()));
        }
        if row.spec.scale == Scale::Log && lower <= 0.0 {
            return Err(Error::invalid(bounds(), "a lower bound above 0", lower.to_string()));
        }
        if row.given && !(row.value >= lower && row.value <= upper) {
            let expected = format!("a value within its bounds {lower}..{upper}");
            return Err(Error::invalid(self.name(index), expected, row.value.to_string()));
        }
        Ok(())
    }

    /// Ties every row to the end of its chain of ties. A tie may lead to another tie, but a circle of ties has no end.
    fn resolve_ties(&mut self) -> Result<(), Error> {
        for index in 0..self.rows.len() {
            let mut target = index;
            let mut steps = 0;
            while let Status::Tied(next) = self.rows[target].status {
                target = next;
                steps += 1;
                if steps > self.rows.len() {
                    return Err(Error::invalid(
                        Subject::OptionOf(OptionName::Tie, self.name(index)),
                        "ties that end at a parameter that is not tied",
                        "a circle of ties",
                    ));
                }
            }
            if target != index {
                self.rows[index].status = Status::Tied(target);
            }
        }
        Ok(())
    }

    /// Parameters that are tied have one value, so that they share the range that the bounds of all of them leave.
    fn narrow_tied(&mut self) -> Result<(), Error> {
        for index in 0..self.rows.len() {
            let Status::Tied(target) = self.rows[index].status else { continue };
            let (followed, following) = (self.rows[target].bounds, self.rows[index].bounds);
            let (lower, upper) = (followed.0.max(following.0), followed.1.min(following.1));
            let tie =
                || Subject::OptionOf(OptionName::Tie, format!("{}={}", self.name(index), self.name(target)));
            if lower >= upper {
                let found = format!("{}..{} and {}..{}", following.0, following.1, followed.0, followed.1);
                return Err(Error::invalid(tie(), "bounds that overlap", found));
            }
            let source = &self.rows[target];
            let stays = source.given || source.status == Status::Fixed;
            if stays && !(source.value >= lower && source.value <= upper) {
                let expected = format!("a value within the bounds of both, {lower}..{upper}");
                return Err(Error::invalid(tie(), expected, source.value.to_string()));
            }
            self.rows[target].bounds = (lower, upper);
        }
        for index in 0..self.rows.len() {
            self.rows[index].bounds = self.rows[self.source(index)].bounds;
        }
        Ok(())
    }

    /// Lists the free rows.
    pub(super) fn list_free(&mut self) {
        self.free = (0..self.rows.len()).filter(|index| self.rows[*index].status == Status::Free).collect();
    }

    /// Gives tied rows the values of the rows that they are tied to.
    pub(super) fn follow(&mut self) {
        for index in 0..self.rows.len() {
            if let Status::Tied(target) = self.rows[index].status {
                self.rows[index].value = self.rows[target].value;
                self.rows[index].initial = self.rows[target].initial;
            }
        }
    }

    /// Creates the table of a model of one channel without a measurement: every parameter is shared, so that no name has a channel.
    ///
    /// # Errors
    /// Those of [`Self::new`], for constraints of the expression.
    pub fn of_one_channel(expression: &Expression) -> Result<Self, Error> {
        let names = expression.lobes().iter().flat_map(|lobe| {
            let own = lobe.parameters().into_iter().filter(|spec| spec.sharing == Sharing::PerChannel);
            own.map(|spec| format!("{}.{}", lobe.name, spec.name))
        });
        let shared = |name: String| Ok((Selector::parse(&name)?, Setting::Shared));
        let settings: Settings = names.map(shared).collect::<Result<_, Error>>()?;
        Self::new(expression, &["f".to_owned()], Azimuths::Several, &settings)
    }

    /// What the data tell about the azimuth of the half vector.
    #[must_use]
    pub fn azimuths(&self) -> Azimuths {
        self.azimuths
    }

    /// All rows, in the order of lobes, parameters and channels.
    #[must_use]
    pub fn rows(&self) -> &[ParameterRow] {
        &self.rows
    }

    /// Indices of the free rows, in order.
    #[must_use]
    pub fn free(&self) -> &[usize] {
        &self.free
    }

    /// The free rows, in order.
    pub fn free_rows(&self) -> impl Iterator<Item = &ParameterRow> {
        self.free.iter().map(|index| &self.rows[*index])
    }

    /// Names of the lobes.
    #[must_use]
    pub fn lobes(&self) -> &[String] {
        &self.lobes
    }

    /// Names of the channels.
    #[must_use]
    pub fn channels(&self) -> &[String] {
        &self.channels
    }

    /// Full name of a row: `lobe.name`, `lobe.name.channel` or `lobe.name[700]`.
    #[must_use]
    pub fn name(&self, index: usize) -> String {
        let row = &self.rows[index];
        let base = self.parameter_name(row);
        match row.channel {
            None => base,
            Some(channel) => format!("{base}{}", channel_suffix(&self.channels[channel])),
        }
    }

    /// The name of a row's lobe.
    pub(crate) fn lobe_name(&self, row: &ParameterRow) -> &str {
        &self.lobes[row.lobe]
    }

    /// The name of a row's channel; `None` if the channels share it.
    pub(crate) fn channel_name(&self, row: &ParameterRow) -> Option<&str> {
        row.channel.map(|channel| self.channels[channel].as_str())
    }

    /// The rows that a selector names, at least one, with their indices.
    ///
    /// # Errors
    /// [`Error::UnknownName`] if it names no row, [`Error::AmbiguousParameter`] if it names parameters of several
    /// lobes.
    pub(crate) fn rows_named(&self, selector: &Selector) -> Result<Vec<(usize, &ParameterRow)>, Error> {
        let spec = |places: &Vec<usize>| places.first().map(|row| self.rows[*row].spec.clone());
        let specs: Vec<Vec<ParamSpec>> =
            self.places.iter().map(|of_lobe| of_lobe.iter().filter_map(spec).collect()).collect();
        Ok(self.matching(selector, &specs)?.into_iter().map(|index| (index, &self.rows[index])).collect())
    }

    /// Every parameter, with its full name.
    #[must_use]
    pub fn parameter_values(&self) -> Vec<ParameterValue> {
        let rows = self.rows.iter().enumerate();
        rows.map(|(index, row)| ParameterValue {
            name: self.name(index),
            value: row.value,
            unit: row.spec.unit.symbol(),
        })
        .collect()
    }

    /// The lobe and the name of a row's parameter, without the channel.
    #[must_use]
    pub fn parameter_name(&self, row: &ParameterRow) -> String {
        format!("{}.{}", self.lobes[row.lobe], row.spec.name)
    }

    /// Pairs of parameters whose product is determined better than either of them.
    #[must_use]
    pub fn products(&self) -> &[Product] {
        &self.products
    }

    /// Whether a lobe has a width, that is, whether it is more than a diffuse base.
    #[must_use]
    pub fn has_width(&self, lobe: usize) -> bool {
        self.rows.iter().any(|row| row.lobe == lobe && row.spec.sharper.is_some())
    }

    /// Number of parameters of a lobe.
    #[must_use]
    pub fn parameters_of(&self, lobe: usize) -> usize {
        self.places[lobe].len()
    }

    /// The rows of a parameter of a lobe: one row, or one per channel.
    #[must_use]
    pub fn places(&self, lobe: usize, parameter: usize) -> &[usize] {
        &self.places[lobe][parameter]
    }

    /// The row from which a parameter of a lobe takes its value in a channel.
    #[must_use]
    pub fn place(&self, lobe: usize, parameter: usize, channel: usize) -> usize {
        assert!(channel < self.channels.len(), "channel {channel} of {}", self.channels.len());
        match self.places(lobe, parameter) {
            [only] => *only,
            of_channels => of_channels[channel],
        }
    }

    /// The row whose value a row has: its own, or the one it is tied to.
    #[must_use]
    pub fn source(&self, index: usize) -> usize {
        match self.rows[index].status {
            Status::Tied(target) => target,
            Status::Free | Status::Fixed | Status::Absent | Status::Apart => index,
        }
    }

    /// The free parameters in the solver's coordinates.
    #[must_use]
    pub fn coordinates(&self) -> Vec<f64> {
        self.free_rows().map(|row| row.coordinate(row.value)).collect()
    }

    /// Bounds in the solver's coordinates.
    #[must_use]
    pub fn coordinate_bounds(&self) -> Vec<(f64, f64)> {
        self.free_rows().map(|row| (row.coordinate(row.bounds.0), row.coordinate(row.bounds.1))).collect()
    }

    /// Sets the free parameters to the given coordinates, and the tied ones along with them.
    pub fn set_coordinates(&mut self, coordinates: &[f64]) {
        assert_eq!(coordinates.len(), self.free.len(), "a coordinate per free parameter");
        for (index, coordinate) in self.free.iter().zip(coordinates) {
            let row = &mut self.rows[*index];
            let (lower, upper) = row.bounds;
            // exp(ln(bound)) may differ from the bound by an ulp.
            row.value = if *coordinate <= row.coordinate(lower) {
                lower
            } else if *coordinate >= row.coordinate(upper) {
                upper
            } else {
                row.value_at(*coordinate).clamp(lower, upper)
            };
        }
        self.follow();
    }

    /// The same table with values that are fitted by their square moved away from 0, where derivatives vanish.
    #[must_use]
    pub(crate) fn off_zero(mut self) -> Self {
        let of_square =
            |row: &&mut ParameterRow| row.spec.scale == Scale::Square && row.status == Status::Free;
        for row in self.rows.iter_mut().filter(of_square) {
            row.value = row.value.max(row.least_square());
        }
        self.follow();
        self
    }

    /// Sets the value of one row and of the rows that are tied to it.
    pub fn set_value(&mut self, index: usize, value: f64) {
        let row = &mut self.rows[index];
        row.value = value.clamp(row.bounds.0, row.bounds.1);
        self.follow();
    }

    /// Takes over the values of free amplitudes from `other`, a table of the same parameters.
    pub(crate) fn take_amplitudes(&mut self, other: &Self) {
        for (row, found) in self.rows.iter_mut().zip(&other.rows) {
            if row.spec.role == Role::Amplitude && row.status == Status::Free {
                row.value = found.value;
            }
        }
        self.follow();
    }

    /// Makes the current values those that the fit starts from.
    pub fn start_here(&mut self) {
        self.rows.iter_mut().for_each(|row| row.initial = row.value);
    }

    /// The same table with every row of a role fixed at its value.
    #[must_use]
    pub fn with_fixed(&self, role: Role) -> Self {
        let mut table = self.clone();
        for row in table.rows.iter_mut().filter(|row| row.spec.role == role && row.status == Status::Free) {
            row.status = Status::Fixed;
        }
        table.list_free();
        table
    }

    /// The same table with a row fixed at its value.
    #[must_use]
    pub(crate) fn with_fixed_row(&self, index: usize) -> Self {
        let mut table = self.clone();
        table.rows[index].status = Status::Fixed;
        table.list_free();
        table
    }

    /// The same table with additional rows freed, apart from those of dead channels.
    #[must_use]
    pub fn with_freed(&self, indices: &[usize]) -> Self {
        let mut table = self.clone();
        for index in indices {
            let dead = table.is_of_dead_channel(*index);
            table.rows[*index].status = if dead { Status::Apart } else { Status::Free };
        }
        table.list_free();
        table
    }

    /// Shapes and amplitudes of every lobe for one channel, in the units of the formulas.
    #[must_use]
    pub fn formula_values(&self, channel: usize) -> Vec<LobeValues> {
        self.values_as(channel, |_, value, factor| value * factor)
    }

    /// Shapes and amplitudes of every lobe for one channel, made by `value` from the index of a row, its value and the number of formula
    /// units in its unit.
    pub(crate) fn values_as<T>(
        &self,
        channel: usize,
        value: impl Fn(usize, f64, f64) -> T,
    ) -> Vec<LobeValues<T>> {
        let of_role = |lobe: usize, role: Role| -> Vec<T> {
            (0..self.parameters_of(lobe))
                .map(|parameter| self.place(lobe, parameter, channel))
                .map(|index| (index, &self.rows[index]))
                .filter(|(_, row)| row.spec.role == role)
                .map(|(index, row)| value(index, row.value, row.spec.unit.factor(row.channel)))
                .collect()
        };
        (0..self.lobes.len())
            .map(|lobe| LobeValues {
                shapes: of_role(lobe, Role::Shape),
                amplitudes: of_role(lobe, Role::Amplitude),
            })
            .collect()
    }

    /// The indices of the rows that a selector names, at least one.
    fn matching(&self, selector: &Selector, specs: &[Vec<ParamSpec>]) -> Result<Vec<usize>, Error> {
        let (lobe, name, channel) = resolve(selector, &self.lobes, specs, &self.channels)?;
        let rows: Vec<usize> = self
            .rows
            .iter()
            .enumerate()
            .filter(|(_, row)| row.spec.name == name && lobe.is_none_or(|l| l == row.lobe))
            .filter(|(_, row)| channel.is_none() || row.channel == channel)
            .map(|(index, _)| index)
            .collect();
        if rows.is_empty() {
            return Err(Error::SharedParameter { selector: selector.to_string(), parameter: name });
        }
        Ok(rows)
    }
}

/// The products that the models of an expression declare.
fn products(expression: &Expression, specs: &[Vec<ParamSpec>]) -> Vec<Product> {
    let mut products = Vec::new();
    for (lobe, (Lobe { model, .. }, specs)) in expression.lobes().iter().zip(specs).enumerate() {
        let position = |name: &str| specs.iter().position(|spec| spec.name == name);
        for (first, second) in model.products() {
            if let (Some(first), Some(second)) = (position(first), position(second)) {
                products.push(Product { lobe, first, second });
            }
        }
    }
    products
}

/// Whether two sets of shapes, each value with its row, belong to different minima.
pub(crate) fn shapes_differ(table: &ParameterTable, a: &[(usize, f64)], b: &[(usize, f64)]) -> bool {
    assert_eq!(a.len(), b.len(), "the same shapes");
    a.iter().zip(b).any(|((row, x), (_, y))| differ(&table.rows()[*row], *x, *y))
}

/// Whether two values of a shape belong to different minima.
pub(crate) fn differ(row: &ParameterRow, x: f64, y: f64) -> bool {
    match row.spec.scale {
        Scale::Log => (x / y).ln().abs() > SAME_VALUE,
        Scale::Linear | Scale::Square => {
            (x - y).abs() > SAME_VALUE * (row.spec.typical.1 - row.spec.typical.0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(settings: &[(&str, Setting)]) -> Result<ParameterTable, Error> {
        let expression = Expression::parse("lambert + cook-torrance + cook-torrance").unwrap();
        let channels = ["r", "g", "550"].map(str::to_owned);
        let settings = settings.iter().map(|(name, s)| (Selector::parse(name).unwrap(), s.clone())).collect();
        ParameterTable::new(&expression, &channels, Azimuths::Several, &settings)
    }

    fn value(table: &ParameterTable, name: &str) -> f64 {
        let index = (0..table.rows().len()).find(|i| table.name(*i) == name).unwrap();
        table.rows()[index].value
    }

    #[test]
    fn names_select_rows() {
        let t = table(&[
            ("kd", Setting::Set(0.5)),
            ("lambert.kd.g", Setting::Set(0.6)),
            ("kd[550]", Setting::Set(0.7)),
            ("cook-torrance#2.m", Setting::Set(0.8)),
        ])
        .unwrap();
        assert_eq!(value(&t, "lambert.kd.r"), 0.5);
        assert_eq!(value(&t, "lambert.kd.g"), 0.6);
        assert_eq!(value(&t, "lambert.kd[550]"), 0.7);
        assert_eq!(value(&t, "cook-torrance#2.m"), 0.8);
        assert_eq!(value(&t, "cook-torrance.m"), 0.2);
    }

    #[test]
    fn ties_follow() {
        let q = Selector::parse("cook-torrance.f0").unwrap();
        let mut t = table(&[("cook-torrance#2.f0", Setting::Tie(q))]).unwrap();
        let f0 = (0..t.rows().len()).find(|i| t.name(*i) == "cook-torrance.f0.g").unwrap();
        t.set_value(f0, 0.3);
        assert_eq!(value(&t, "cook-torrance#2.f0.g"), 0.3);
        assert!(t.free().iter().all(|i| !t.name(*i).starts_with("cook-torrance#2.f0")));
    }

    #[test]
    fn tied_parameters_share_the_range_that_their_bounds_leave() {
        let tie = || ("cook-torrance#2.f0", Setting::Tie(Selector::parse("cook-torrance.f0").unwrap()));
        let bounds = |t: &ParameterTable, name: &str| {
            t.rows()[(0..t.rows().len()).find(|i| t.name(*i) == name).unwrap()].bounds
        };
        let narrow = ("cook-torrance#2.f0.g", Setting::Bounds(0.3, 2.0));
        let wide = ("cook-torrance.f0", Setting::Bounds(0.0, 0.5));
        let t = table(&[tie(), narrow.clone(), wide.clone()]).unwrap();
        for name in ["cook-torrance.f0.g", "cook-torrance#2.f0.g"] {
            assert_eq!(bounds(&t, name), (0.3, 0.5));
            assert_eq!(value(&t, name), 0.3);
        }
        assert_eq!(bounds(&t, "cook-torrance#2.f0.r"), (0.0, 0.5));

        let apart = ("cook-torrance.f0", Setting::Bounds(0.0, 0.2));
        let message = table(&[tie(), narrow.clone(), apart]).unwrap_err().to_string();
        assert!(message.contains("expected bounds that overlap, found 0.3..2 and 0..0.2"), "{message}");
        let message =
            table(&[tie(), narrow, ("cook-torrance.f0", Setting::Fix(0.1))]).unwrap_err().to_string();
        assert!(message.contains("the bounds of both, 0.3..1, found 0.1"), "{message}");
    }

    #[test]
    fn the_sharpest_lobe_comes_first() {
        let set = |t: &mut ParameterTable, name: &str, value: f64| {
            let index = (0..t.rows().len()).find(|i| t.name(*i) == name).unwrap();
            t.set_value(index, value);
        };
        let mut t = table(&[]).unwrap();
        set(&mut t, "cook-torrance.m", 0.5);
        set(&mut t, "cook-torrance.f0.g", 0.7);
        set(&mut t, "cook-torrance#2.m", 0.1);
        assert!(t.sort_lobes());
        assert_eq!(value(&t, "cook-torrance.m"), 0.1);
        assert_eq!(value(&t, "cook-torrance#2.m"), 0.5);
        assert_eq!(value(&t, "cook-torrance#2.f0.g"), 0.7);
        assert!(!t.sort_lobes());
        // A bound of its own fixes a lobe's place; a tie between the two lobes does not.
        let mut t = table(&[("cook-torrance.m", Setting::Bounds(0.3, 1.0))]).unwrap();
        set(&mut t, "cook-torrance#2.m", 0.1);
        assert!(!t.sort_lobes());
        let q = Selector::parse("cook-torrance.f0").unwrap();
        let mut t = table(&[("cook-torrance#2.f0", Setting::Tie(q))]).unwrap();
        set(&mut t, "cook-torrance#2.m", 0.1);
        set(&mut t, "cook-torrance.f0.g", 0.7);
        assert!(t.sort_lobes());
        assert_eq!(value(&t, "cook-torrance#2.f0.g"), 0.7);
    }

    #[test]
    fn mistakes_are_named() {
        for (name, setting, words) in [
            (
                "m",
                Setting::Free,
                "several parameters have this name: write one of cook-torrance.m, cook-torrance#2.m",
            ),
            ("q", Setting::Free, "found 'q'"),
            ("cook-torrance#3.m", Setting::Free, "found 'cook-torrance#3'"),
            ("lambert.kd.x", Setting::Free, "found 'x'"),
            ("cook-torrance.m.r", Setting::Free, "shared by all channels"),
            ("kd", Setting::Bounds(1.0, 0.5), "lower bound below the upper"),
            ("kd", Setting::Fix(7.0), "within its bounds"),
            ("cook-torrance.m", Setting::Bounds(0.0, 0.5), "above 0"),
            ("kd", Setting::Tie(Selector::parse("kd").unwrap()), "found the same parameter"),
        ] {
            let message = table(&[(name, setting)]).unwrap_err().to_string();
            assert!(message.contains(words), "{name}: {message}");
        }
    }
}
