//! The parameters of an expression for given channels: values, bounds, and which of them the fit moves.

use crate::error::{Error, excerpt, short};
use crate::model::{Expression, Lobe, ParamSpec, Role, Scale, Sharing, Sharper};
use serde::Serialize;
use std::fmt;

/// What the fit does with a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// It is fitted.
    Free,
    /// It keeps its value.
    Fixed,
    /// It follows the parameter in another row.
    Tied(usize),
}

/// A parameter as reports show it.
#[derive(Clone, Debug, Serialize)]
pub struct ParameterValue {
    /// Full name.
    pub name: String,
    /// In `unit`.
    pub value: f64,
    /// Its unit.
    pub unit: &'static str,
}

/// One number of the model: a parameter, for one channel where it is not shared.
#[derive(Clone, Debug)]
pub struct Row {
    /// Index of the lobe in the expression.
    pub lobe: usize,
    /// Index of the parameter in the lobe's declaration.
    pub parameter: usize,
    /// The declaration.
    pub spec: ParamSpec,
    /// Index of the channel; none for a shared parameter.
    pub channel: Option<usize>,
    /// Current value, in the parameter's unit.
    pub value: f64,
    /// Value that the fit started from.
    pub initial: f64,
    /// Whether the user gave that value.
    pub given: bool,
    /// Smallest and largest value.
    pub bounds: (f64, f64),
    /// Free, fixed or tied.
    pub status: Status,
}

impl Row {
    fn coordinate(&self, value: f64) -> f64 {
        match self.spec.scale {
            Scale::Linear => value,
            Scale::Log => value.ln(),
            Scale::Square => value * value,
        }
    }

    fn value_at(&self, coordinate: f64) -> f64 {
        match self.spec.scale {
            Scale::Linear => coordinate,
            Scale::Log => coordinate.exp(),
            Scale::Square => coordinate.max(0.0).sqrt(),
        }
    }

    /// d value/d coordinate at the current value.
    #[must_use]
    pub fn stretch(&self) -> f64 {
        match self.spec.scale {
            Scale::Linear => 1.0,
            Scale::Log => self.value,
            Scale::Square => 0.5 / self.value.max(self.least_square()),
        }
    }

    /// Where the derivative with respect to the square is taken for values that are smaller: close enough to
    /// 0 to change a model by no more than 1e-10 of itself, far enough for the quotient to keep its digits.
    fn least_square(&self) -> f64 {
        1e-6 * self.spec.typical.1
    }

    /// Width of the range between the bounds, in the solver's coordinate.
    pub(super) fn width(&self) -> f64 {
        self.coordinate(self.bounds.1) - self.coordinate(self.bounds.0)
    }

    /// Whether the value is at its lower bound, to rounding.
    #[must_use]
    pub fn at_lower(&self) -> bool {
        let (lower, upper) = self.bounds;
        self.value - lower <= 1e-12 * (upper - lower).min(lower.abs().max(1e-3))
    }

    /// Whether the value is at its upper bound, to rounding.
    #[must_use]
    pub fn at_upper(&self) -> bool {
        let (lower, upper) = self.bounds;
        upper - self.value <= 1e-12 * (upper - lower).min(upper.abs().max(1e-3))
    }
}

/// The name of one or several parameters: `[lobe.]name[.channel]`, the channel also as `[channel]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Selector {
    text: String,
    /// Everything before a bracketed channel, split at dots.
    parts: Vec<String>,
    /// The channel in brackets.
    bracketed: Option<String>,
}

impl Selector {
    /// Reads a parameter's name.
    ///
    /// # Errors
    /// [`Error::Usage`] for a text that cannot be one.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let text = text.trim();
        let wrong = || {
            Error::Usage(format!(
                "parameter: expected a name such as 'm', 'lambert.kd.r' or 'cook-torrance#2.f0[700]', found {}",
                excerpt(text)
            ))
        };
        let (name, bracketed) = match text.split_once('[') {
            Some((name, rest)) => (name, Some(rest.strip_suffix(']').ok_or_else(wrong)?.to_owned())),
            None => (text, None),
        };
        let parts: Vec<String> = name.split('.').map(str::to_owned).collect();
        let most = if bracketed.is_some() { 2 } else { 3 };
        if parts.len() > most || parts.iter().any(String::is_empty) {
            return Err(wrong());
        }
        Ok(Self { text: text.to_owned(), parts, bracketed })
    }
}

impl Selector {
    /// The channel, where the name can only be read with one: `name[channel]` or `lobe.name.channel`, or
    /// `name.channel` if no model of that name exists.
    #[must_use]
    pub fn channel_if_any(&self) -> Option<String> {
        match (self.parts.as_slice(), &self.bracketed) {
            (_, Some(channel)) => Some(channel.clone()),
            ([_, _, channel], None) => Some(channel.clone()),
            ([first, channel], None) => {
                let model = first.split('#').next().unwrap_or_default();
                let is_lobe = crate::model::REGISTRY.iter().any(|entry| entry.name == model);
                (!is_lobe).then(|| channel.clone())
            }
            _ => None,
        }
    }
}

impl Selector {
    /// The parameter's own name, without lobe and channel.
    #[must_use]
    pub fn parameter(&self) -> &str {
        let of_lobe = match (self.parts.len(), self.channel_if_any()) {
            (3, _) => 1,
            (2, Some(_)) if self.bracketed.is_none() => 0,
            (count, _) => count.saturating_sub(1),
        };
        self.parts.get(of_lobe).map_or("", String::as_str)
    }

    /// The same parameter of one channel.
    #[must_use]
    pub fn of_channel(&self, channel: &str) -> Self {
        let text = format!("{}[{channel}]", self.text);
        Self { text, parts: self.parts.clone(), bracketed: Some(channel.to_owned()) }
    }
}

impl fmt::Display for Selector {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&short(&self.text))
    }
}

/// One wish of the user, in the order given.
#[derive(Clone, Debug, PartialEq)]
pub enum Setting {
    /// Keep at a value.
    Fix(f64),
    /// Start from a value.
    Init(f64),
    /// Stay between two values.
    Bounds(f64, f64),
    /// Fit although fixed by default.
    Free,
    /// Equal another parameter.
    Tie(Selector),
    /// One value per channel.
    PerChannel,
    /// One value for all channels.
    Shared,
    /// Have a value, for evaluation.
    Set(f64),
}

/// All wishes of the user about parameters.
pub type Settings = Vec<(Selector, Setting)>;

/// Every number of a model, and which of them are free.
#[derive(Clone, Debug)]
pub struct ParameterTable {
    lobes: Vec<String>,
    /// The model of each lobe, every choice spelled out.
    kinds: Vec<String>,
    channels: Vec<String>,
    rows: Vec<Row>,
    /// Per lobe and parameter: the row of each channel; one row alone for a shared parameter.
    places: Vec<Vec<Vec<usize>>>,
    /// Rows of the free parameters, in order.
    free: Vec<usize>,
    products: Vec<Product>,
}

/// Two parameters of a lobe whose product is determined better than either of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Product {
    /// Index of the lobe in the expression.
    pub lobe: usize,
    /// Index of one factor in the lobe's declaration.
    pub first: usize,
    /// Index of the other.
    pub second: usize,
}

impl ParameterTable {
    /// The parameters of `expression` for `channels`, with the user's `settings`. `isotropic` data do not
    /// know the half vector's azimuth: parameters that only it tells apart are tied.
    ///
    /// # Errors
    /// [`Error::Usage`] for a setting that names nothing, or does not fit.
    pub fn new(
        expression: &Expression,
        channels: &[String],
        isotropic: bool,
        settings: &Settings,
    ) -> Result<Self, Error> {
        let lobes: Vec<String> = expression.lobes().iter().map(|lobe| lobe.name.clone()).collect();
        let mut specs: Vec<Vec<ParamSpec>> =
            expression.lobes().iter().map(|lobe| lobe.model.parameters()).collect();
        for (selector, setting) in settings {
            let sharing = match setting {
                Setting::PerChannel => Sharing::PerChannel,
                Setting::Shared => Sharing::Shared,
                _ => continue,
            };
            let (lobe, name, channel) = resolve(selector, &lobes, &specs, channels)?;
            if channel.is_some() {
                return Err(Error::Usage(format!("{selector}: expected a parameter without a channel")));
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
        };
        for (lobe, lobe_specs) in specs.iter().enumerate() {
            let mut places = Vec::new();
            for (parameter, spec) in lobe_specs.iter().enumerate() {
                let first = table.rows.len();
                let per_row: Vec<Option<usize>> = match spec.sharing {
                    Sharing::Shared => vec![None],
                    Sharing::PerChannel => (0..channels.len()).map(Some).collect(),
                };
                table.rows.extend(per_row.into_iter().map(|channel| Row {
                    lobe,
                    parameter,
                    spec: spec.clone(),
                    channel,
                    value: spec.initial,
                    initial: spec.initial,
                    given: false,
                    bounds: spec.bounds,
                    status: if spec.fixed { Status::Fixed } else { Status::Free },
                }));
                places.push((first..table.rows.len()).collect());
            }
            table.places.push(places);
        }
        if isotropic {
            table.tie_isotropic(settings, &specs)?;
        }
        for (selector, setting) in settings {
            table.apply(selector, setting, &specs)?;
        }
        table.finish()?;
        Ok(table)
    }

    /// Ties the parameters that only the half vector's azimuth tells apart, unless the user fixed them.
    fn tie_isotropic(&mut self, settings: &Settings, specs: &[Vec<ParamSpec>]) -> Result<(), Error> {
        let mut ties = Vec::new();
        for (index, row) in self.rows.iter().enumerate() {
            let Some(other) = row.spec.isotropic_as else { continue };
            let target = self
                .rows
                .iter()
                .position(|r| r.lobe == row.lobe && r.spec.name == other && r.channel == row.channel);
            ties.extend(target.map(|target| (index, target)));
        }
        for (selector, setting) in settings {
            if matches!(setting, Setting::Fix(_) | Setting::Set(_)) {
                let rows = self.matching(selector, specs)?;
                ties.retain(|(index, _)| !rows.contains(index));
            }
        }
        for (index, target) in ties {
            if let Some(row) = self.rows.get_mut(index) {
                row.status = Status::Tied(target);
            }
        }
        Ok(())
    }

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
            let Some(row) = self.rows.get_mut(index) else { continue };
            match *setting {
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

    fn tie(
        &mut self,
        selector: &Selector,
        other: &Selector,
        rows: &[usize],
        targets: &[usize],
    ) -> Result<(), Error> {
        for &index in rows {
            let channel = self.rows.get(index).and_then(|row| row.channel);
            let same_channel = |target: &&usize| {
                self.rows.get(**target).is_some_and(|t| t.channel == channel || t.channel.is_none())
            };
            // One value for all may be followed by every channel; otherwise channel follows channel.
            let target = match targets {
                [only] => Some(*only),
                several => several.iter().find(same_channel).copied(),
            };
            match target {
                Some(target) if target != index => {
                    if let Some(row) = self.rows.get_mut(index) {
                        row.status = Status::Tied(target);
                    }
                }
                _ => {
                    return Err(Error::Usage(format!(
                        "--tie {selector}={other}: expected two different parameters with the same channels"
                    )));
                }
            }
        }
        Ok(())
    }

    /// Checks values against bounds, ties against each other, and lists what is free.
    fn finish(&mut self) -> Result<(), Error> {
        for index in 0..self.rows.len() {
            let name = self.name(index);
            let Some(row) = self.rows.get_mut(index) else { continue };
            let (lower, upper) = row.bounds;
            if lower.partial_cmp(&upper) != Some(std::cmp::Ordering::Less) {
                return Err(Error::Usage(format!(
                    "--bounds {name}: expected the lower bound below the upper, found {lower}..{upper}"
                )));
            }
            if row.spec.scale == Scale::Square && lower < 0.0 {
                return Err(Error::Usage(format!(
                    "--bounds {name}: expected a lower bound of at least 0, found {lower}"
                )));
            }
            if row.spec.scale == Scale::Log && lower <= 0.0 {
                return Err(Error::Usage(format!(
                    "--bounds {name}: expected a lower bound above 0, found {lower}"
                )));
            }
            if row.given && !(row.value >= lower && row.value <= upper) {
                return Err(Error::Usage(format!(
                    "{name}: expected a value within its bounds {lower}..{upper}, found {}",
                    row.value
                )));
            }
            row.value = row.value.clamp(lower, upper);
            row.initial = row.value;
        }
        // A tie may lead to another; a circle has no end.
        for index in 0..self.rows.len() {
            let mut target = index;
            let mut steps = 0;
            while let Some(Status::Tied(next)) = self.rows.get(target).map(|row| row.status) {
                target = next;
                steps += 1;
                if steps > self.rows.len() {
                    return Err(Error::Usage(format!("--tie {}: ties form a circle", self.name(index))));
                }
            }
            if target != index
                && let Some(row) = self.rows.get_mut(index)
            {
                row.status = Status::Tied(target);
            }
        }
        self.free = (0..self.rows.len())
            .filter(|index| self.rows.get(*index).is_some_and(|row| row.status == Status::Free))
            .collect();
        self.follow();
        Ok(())
    }

    /// Gives tied rows the value of what they are tied to.
    fn follow(&mut self) {
        for index in 0..self.rows.len() {
            let Some(Status::Tied(target)) = self.rows.get(index).map(|row| row.status) else { continue };
            if let Some((value, initial)) = self.rows.get(target).map(|t| (t.value, t.initial))
                && let Some(row) = self.rows.get_mut(index)
            {
                row.value = value;
                row.initial = initial;
            }
        }
    }

    /// All rows, lobe by lobe, parameter by parameter, channel by channel.
    #[must_use]
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// Indices of the rows that are free, in order.
    #[must_use]
    pub fn free(&self) -> &[usize] {
        &self.free
    }

    /// The free rows, in order.
    pub fn free_rows(&self) -> impl Iterator<Item = &Row> {
        self.free.iter().filter_map(|index| self.rows.get(*index))
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
        let Some(row) = self.rows.get(index) else { return String::new() };
        let lobe = self.lobes.get(row.lobe).map_or("", String::as_str);
        let base = format!("{lobe}.{}", row.spec.name);
        match row.channel.and_then(|c| self.channels.get(c)) {
            None => base,
            Some(channel) => format!("{base}{}", channel_suffix(channel)),
        }
    }

    /// Every parameter by its full name.
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

    /// Lobe and parameter of a row, without the channel.
    #[must_use]
    pub fn parameter_name(&self, row: &Row) -> String {
        format!("{}.{}", self.lobes.get(row.lobe).map_or("", String::as_str), row.spec.name)
    }

    /// Pairs of parameters whose product is determined better than either of them.
    #[must_use]
    pub fn products(&self) -> &[Product] {
        &self.products
    }

    /// Whether a lobe has a width: whether it is more than a diffuse base.
    #[must_use]
    pub fn has_width(&self, lobe: usize) -> bool {
        self.rows.iter().any(|row| row.lobe == lobe && row.spec.sharper.is_some())
    }

    /// The rows that a parameter of a lobe occupies, one or one per channel.
    #[must_use]
    pub fn places(&self, lobe: usize, parameter: usize) -> &[usize] {
        self.places.get(lobe).and_then(|p| p.get(parameter)).map_or(&[], Vec::as_slice)
    }

    /// The row that a parameter of a lobe takes its value from in a channel.
    #[must_use]
    pub fn place(&self, lobe: usize, parameter: usize, channel: usize) -> Option<usize> {
        match self.places(lobe, parameter) {
            [only] => Some(*only),
            several => several.get(channel).copied(),
        }
    }

    /// The row that a row stands for: itself, or what it is tied to.
    #[must_use]
    pub fn source(&self, index: usize) -> usize {
        match self.rows.get(index).map(|row| row.status) {
            Some(Status::Tied(target)) => target,
            _ => index,
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

    /// Moves the free parameters to the given coordinates, and what is tied to them along.
    pub fn set_coordinates(&mut self, coordinates: &[f64]) {
        for (index, coordinate) in self.free.clone().into_iter().zip(coordinates) {
            if let Some(row) = self.rows.get_mut(index) {
                let (lower, upper) = row.bounds;
                // exp(ln(bound)) may miss the bound by an ulp.
                row.value = if *coordinate <= row.coordinate(lower) {
                    lower
                } else if *coordinate >= row.coordinate(upper) {
                    upper
                } else {
                    row.value_at(*coordinate).clamp(lower, upper)
                };
            }
        }
        self.follow();
    }

    /// The same table with values that are fitted by their square kept off 0, where derivatives vanish.
    #[must_use]
    pub(super) fn off_zero(mut self) -> Self {
        let of_square = |row: &&mut Row| row.spec.scale == Scale::Square && row.status == Status::Free;
        for row in self.rows.iter_mut().filter(of_square) {
            row.value = row.value.max(row.least_square());
        }
        self.follow();
        self
    }

    /// Sets the value of one row, and of what is tied to it.
    pub fn set_value(&mut self, index: usize, value: f64) {
        if let Some(row) = self.rows.get_mut(index) {
            row.value = value.clamp(row.bounds.0, row.bounds.1);
        }
        self.follow();
    }

    /// Puts lobes of one kind in order, the sharpest first; returns whether any moved.
    ///
    /// Their sum does not depend on which is which. Only lobes that are alike in everything but their
    /// values are exchanged: one with a value or a bound of its own from the user keeps its place.
    pub fn sort_lobes(&mut self) -> bool {
        let mut moved = false;
        // Every exchange takes one pair out of disorder and brings none into it.
        while let Some((a, b)) = self.disorder() {
            let rows = |lobe: usize| self.places.get(lobe).map_or(Vec::new(), |places| places.concat());
            for (i, j) in rows(a).into_iter().zip(rows(b)) {
                self.exchange(i, j);
            }
            moved = true;
        }
        self.follow();
        moved
    }

    /// Whether lobes of one kind stand in order, the sharpest first.
    #[must_use]
    pub fn is_sorted(&self) -> bool {
        self.disorder().is_none()
    }

    /// Whether some lobes could change places without changing the model.
    #[must_use]
    pub fn has_exchangeable_lobes(&self) -> bool {
        self.pairs().any(|(a, b)| self.exchangeable(a, b))
    }

    /// Two lobes of one kind of which the sharper one comes second.
    fn disorder(&self) -> Option<(usize, usize)> {
        self.pairs().find(|(a, b)| self.out_of_order(*a, *b))
    }

    /// All pairs of lobes, as written.
    fn pairs(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let count = self.lobes.len();
        (0..count).flat_map(move |a| (a + 1..count).map(move |b| (a, b)))
    }

    fn exchange(&mut self, i: usize, j: usize) {
        let values = |row: Option<&Row>| row.map(|row| (row.value, row.initial));
        let (Some(first), Some(second)) = (values(self.rows.get(i)), values(self.rows.get(j))) else {
            return;
        };
        for (index, (value, initial)) in [(i, second), (j, first)] {
            if let Some(row) = self.rows.get_mut(index) {
                (row.value, row.initial) = (value, initial);
            }
        }
    }

    /// Whether lobe `b` is the sharper one of two that may be exchanged.
    fn out_of_order(&self, a: usize, b: usize) -> bool {
        if !self.exchangeable(a, b) {
            return false;
        }
        let key = |lobe: usize| {
            let rows = self.places.get(lobe)?.iter().filter_map(|rows| self.rows.get(*rows.first()?));
            rows.filter_map(|row| Some((row.spec.sharper?, row.value))).next()
        };
        match (key(a), key(b)) {
            (Some((Sharper::Smaller, first)), Some((_, second))) => second < first,
            (Some((Sharper::Larger, first)), Some((_, second))) => second > first,
            _ => false,
        }
    }

    /// Whether two lobes are of one kind and the user has not told them apart.
    fn exchangeable(&self, a: usize, b: usize) -> bool {
        if self.kinds.get(a) != self.kinds.get(b) {
            return false;
        }
        let rows = |lobe: usize| self.places.get(lobe).map_or(Vec::new(), |places| places.concat());
        let (first, second) = (rows(a), rows(b));
        let alike = |i: usize, j: usize| {
            let (Some(x), Some(y)) = (self.rows.get(i), self.rows.get(j)) else { return false };
            let same_role = match (x.status, y.status) {
                (Status::Free, Status::Free) => true,
                (Status::Fixed, Status::Fixed) => x.value == y.value,
                // Tied to each other, or each to the same parameter of its own lobe or of a third.
                (Status::Tied(t), _) if t == j => true,
                (_, Status::Tied(t)) if t == i => true,
                (Status::Tied(s), Status::Tied(t)) => {
                    let within = |lobe: &[usize], row: usize| lobe.iter().position(|r| *r == row);
                    s == t || within(&first, s).is_some_and(|at| within(&second, t) == Some(at))
                }
                _ => false,
            };
            same_role && !x.given && !y.given && x.bounds == y.bounds
        };
        first.len() == second.len() && first.iter().zip(&second).all(|(i, j)| alike(*i, *j))
    }

    /// Declares the current values to be those that the fit starts from.
    pub fn start_here(&mut self) {
        self.rows.iter_mut().for_each(|row| row.initial = row.value);
    }

    /// The same table with every row of a role held at its value.
    #[must_use]
    pub fn with_fixed(&self, role: Role) -> Self {
        let mut table = self.clone();
        for row in table.rows.iter_mut().filter(|row| row.spec.role == role && row.status == Status::Free) {
            row.status = Status::Fixed;
        }
        table.free.retain(|index| table.rows.get(*index).is_some_and(|row| row.status == Status::Free));
        table
    }

    /// The same table with further rows free.
    #[must_use]
    pub fn with_freed(&self, indices: &[usize]) -> Self {
        let mut table = self.clone();
        for index in indices {
            if let Some(row) = table.rows.get_mut(*index) {
                row.status = Status::Free;
            }
        }
        table.free = (0..table.rows.len())
            .filter(|index| table.rows.get(*index).is_some_and(|row| row.status == Status::Free))
            .collect();
        table
    }

    /// Shapes and amplitudes of every lobe for one channel, in formula units.
    #[must_use]
    pub fn formula_values(&self, channel: usize) -> Vec<(Vec<f64>, Vec<f64>)> {
        let of_role = |lobe: usize, role: Role| -> Vec<f64> {
            let parameters = self.places.get(lobe).map_or(0, Vec::len);
            (0..parameters)
                .filter_map(|parameter| self.place(lobe, parameter, channel))
                .filter_map(|index| self.rows.get(index))
                .filter(|row| row.spec.role == role)
                .map(|row| row.value * row.spec.unit.factor(row.channel))
                .collect()
        };
        (0..self.lobes.len())
            .map(|lobe| (of_role(lobe, Role::Shape), of_role(lobe, Role::Amplitude)))
            .collect()
    }

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
            return Err(Error::Usage(format!(
                "{selector}: '{name}' is shared by all channels: name it without one, or add --per-channel {name}"
            )));
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

/// How a channel is appended to a parameter's name.
#[must_use]
pub fn channel_suffix(channel: &str) -> String {
    if channel.contains('.') || channel.parse::<f64>().is_ok() {
        format!("[{channel}]")
    } else {
        format!(".{channel}")
    }
}

/// Lobe (if named), parameter and channel (if named) of a selector.
fn resolve(
    selector: &Selector,
    lobes: &[String],
    specs: &[Vec<ParamSpec>],
    channels: &[String],
) -> Result<(Option<usize>, String, Option<usize>), Error> {
    let find_lobe = |name: &String| lobes.iter().position(|lobe| lobe == name);
    let (lobe, name, channel) = match (selector.parts.as_slice(), &selector.bracketed) {
        ([name], channel) => (None, name, channel.as_ref()),
        ([lobe, name], Some(channel)) => (Some(lobe), name, Some(channel)),
        ([first, second], None) if find_lobe(first).is_some() => (Some(first), second, None),
        ([first, second], None) if specs.iter().flatten().any(|spec| spec.name == first) => {
            (None, first, Some(second))
        }
        ([first, second], None) => (Some(first), second, None),
        ([lobe, name, channel], None) => (Some(lobe), name, Some(channel)),
        _ => return Err(Error::Usage(format!("{selector}: not a parameter"))),
    };
    let lobe = match lobe {
        None => None,
        Some(lobe) => Some(find_lobe(lobe).ok_or_else(|| {
            Error::Usage(format!(
                "{selector}: expected a lobe among {}, found {}",
                lobes.join(", "),
                excerpt(lobe)
            ))
        })?),
    };
    let holders: Vec<usize> = specs
        .iter()
        .enumerate()
        .filter(|(index, lobe_specs)| {
            lobe.is_none_or(|l| l == *index) && lobe_specs.iter().any(|spec| spec.name == name)
        })
        .map(|(index, _)| index)
        .collect();
    match holders.as_slice() {
        [] => {
            let mut known: Vec<String> = Vec::new();
            for (lobe, lobe_specs) in lobes.iter().zip(specs) {
                known.extend(lobe_specs.iter().map(|spec| format!("{lobe}.{}", spec.name)));
            }
            return Err(Error::Usage(format!(
                "{selector}: expected a parameter among {}, found {}",
                known.join(", "),
                excerpt(name)
            )));
        }
        [_] => {}
        several => {
            let names: Vec<String> = several
                .iter()
                .filter_map(|index| lobes.get(*index))
                .map(|lobe| format!("{lobe}.{name}"))
                .collect();
            return Err(Error::Usage(format!(
                "{selector}: several lobes have one: name {}",
                names.join(" or ")
            )));
        }
    }
    let channel = match channel {
        None => None,
        Some(wanted) => Some(channels.iter().position(|channel| channel == wanted).ok_or_else(|| {
            Error::Usage(format!(
                "{selector}: expected a channel among {}, found {}",
                channels.join(", "),
                excerpt(wanted)
            ))
        })?),
    };
    Ok((lobe, name.clone(), channel))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(settings: &[(&str, Setting)]) -> Result<ParameterTable, Error> {
        let expression = Expression::parse("lambert + cook-torrance + cook-torrance").unwrap();
        let channels = ["r", "g", "550"].map(str::to_owned);
        let settings = settings.iter().map(|(name, s)| (Selector::parse(name).unwrap(), s.clone())).collect();
        ParameterTable::new(&expression, &channels, false, &settings)
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
        // A bound of its own gives a lobe its place; a tie between the two does not.
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
            ("m", Setting::Free, "several lobes"),
            ("q", Setting::Free, "found 'q'"),
            ("cook-torrance#3.m", Setting::Free, "found 'cook-torrance#3'"),
            ("lambert.kd.x", Setting::Free, "found 'x'"),
            ("cook-torrance.m.r", Setting::Free, "shared by all channels"),
            ("kd", Setting::Bounds(1.0, 0.5), "lower bound below the upper"),
            ("kd", Setting::Fix(7.0), "within its bounds"),
            ("cook-torrance.m", Setting::Bounds(0.0, 0.5), "above 0"),
            ("kd", Setting::Tie(Selector::parse("kd").unwrap()), "two different"),
        ] {
            let message = table(&[(name, setting)]).unwrap_err().to_string();
            assert!(message.contains(words), "{name}: {message}");
        }
    }
}
