//! Constraints from options and from inside an expression, put together.

use super::in_expression::{LobeSetting, contradict};
use super::selector::{Selector, Setting, Settings, resolve};
use crate::error::{Error, NameKind, short};
use crate::model::{Expression, Lobe, ParamSpec};

/// The names that constraints may refer to.
struct Names<'a> {
    lobes: Vec<String>,
    specs: Vec<Vec<ParamSpec>>,
    channels: &'a [String],
}

impl<'a> Names<'a> {
    fn of(expression: &Expression, channels: &'a [String]) -> Self {
        Self {
            lobes: expression.lobes().iter().map(|lobe| lobe.name.clone()).collect(),
            specs: expression.lobes().iter().map(Lobe::parameters).collect(),
            channels,
        }
    }

    /// What a constraint is on: its lobe, parameter and channel.
    fn place(&self, selector: &Selector) -> Result<(usize, String, Option<String>), Error> {
        let (lobe, name, channel) = resolve(selector, &self.lobes, &self.specs, self.channels)?;
        let holder = || self.specs.iter().position(|specs| specs.iter().any(|spec| spec.name == name));
        let channel = channel.and_then(|index| self.channels.get(index)).cloned();
        Ok((lobe.or_else(holder).unwrap_or_default(), name, channel))
    }

    fn constraint(&self, (selector, setting): &(Selector, Setting)) -> Result<LobeSetting, Error> {
        let (lobe, name, channel) = self.place(selector)?;
        Ok(LobeSetting { lobe, name, channel, setting: setting.clone() })
    }

    /// Whether a constraint can stand inside the expression: starts cannot, nor ties to another lobe or to a channel.
    fn is_inside(&self, constraint: &LobeSetting) -> Result<bool, Error> {
        let can = constraint.can_be_written();
        let Setting::Tie(other) = &constraint.setting else { return Ok(can) };
        let (lobe, name, channel) = self.place(other)?;
        Ok(can && lobe == constraint.lobe && name != constraint.name && channel.is_none())
    }
}

/// Whether a constraint's names are names of `expression`, apart from channels.
#[must_use]
pub fn applies(expression: &Expression, constraint: &(Selector, Setting)) -> bool {
    let names = Names::of(expression, &[]);
    let known = |selector: &Selector| {
        !matches!(
            names.place(selector),
            Err(Error::UnknownName { kind: NameKind::Parameter | NameKind::Lobe, .. })
        )
    };
    known(&constraint.0) && if let Setting::Tie(other) = &constraint.1 { known(other) } else { true }
}

/// Checks that no two constraints on the same parameter contradict each other.
///
/// # Errors
/// [`Error::Invalid`] for two that do, and [`Error::UnknownName`] for one that names nothing.
pub(super) fn check_contradictions(
    expression: &Expression,
    settings: &Settings,
    channels: &[String],
) -> Result<(), Error> {
    let names = Names::of(expression, channels);
    let mut all: Vec<LobeSetting> = Vec::new();
    for given in settings {
        let constraint = names.constraint(given)?;
        let same = |other: &&LobeSetting| {
            (other.lobe, &other.name, &other.channel)
                == (constraint.lobe, &constraint.name, &constraint.channel)
        };
        let mut others = all.iter().filter(same);
        if let Some(other) = others.find(|other| contradict(&other.setting, &constraint.setting)) {
            let [one, two] = [other, &constraint].map(|constraint| short(&constraint.to_string()));
            let found = format!("two that contradict each other, {one} and {two}");
            return Err(Error::invalid(given.0.to_string(), "one constraint", found));
        }
        all.push(constraint);
    }
    Ok(())
}

/// Writes the constraints of options into the expression where they can stand there. Returns the expression and the constraints
/// that remain.
///
/// # Errors
/// [`Error::UnknownName`] for a constraint that names nothing.
pub(crate) fn written_inside(
    expression: &Expression,
    settings: &Settings,
    channels: &[String],
) -> Result<(Expression, Settings), Error> {
    let names = Names::of(expression, channels);
    let mut inside: Vec<LobeSetting> = Vec::new();
    let mut remaining = Settings::new();
    for given in expression.settings()?.iter().chain(settings) {
        let mut constraint = names.constraint(given)?;
        let is_inside = names.is_inside(&constraint)?;
        if let (true, Setting::Tie(other)) = (is_inside, &constraint.setting) {
            // The other is of the same lobe: its name alone stands in the expression.
            constraint.setting = Setting::Tie(Selector::parse(&names.place(other)?.1)?);
        }
        if !is_inside {
            remaining.push(given.clone());
        } else if !inside.contains(&constraint) {
            inside.push(constraint);
        }
    }
    Ok((expression.with_settings(inside), remaining))
}
