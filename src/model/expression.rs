//! Sums of models, written as `lambert + cook-torrance(d=ggx)`.

use super::energy::largest_albedo;
use super::registry::{LobeCoefficients, summed};
use super::strength::{STRENGTH, Strength, added};
use super::{AnyModel, BasisBlock, Choices, Derivatives, ModelEntry, ParamSpec, REGISTRY};
use crate::error::{Error, NameKind, excerpt};
use crate::geometry::{Block, Directions, Geometry, Row};
use crate::math::Scalar;
use crate::parameters::Settings;
use crate::parameters::in_expression::{self, LobeSetting, parameter_of};

/// One model of a sum.
#[derive(Clone, Debug)]
pub struct Lobe {
    /// Name in reports and parameter names: that of the model, followed by `#2`, `#3` from the second of its kind on.
    pub name: String,
    /// The model.
    pub model: AnyModel,
    choices: Choices,
    /// Whether the sum gives it a strength, because its model has none. It is the last amplitude.
    has_added_strength: bool,
}

impl Lobe {
    /// The parameters, in the order of the report.
    #[must_use]
    pub fn parameters(&self) -> Vec<ParamSpec> {
        let mut parameters = self.model.parameters();
        parameters.extend(self.has_added_strength.then(added));
        parameters
    }

    /// The value chosen for an option; empty if the model has no such option.
    #[must_use]
    pub fn choice(&self, key: &str) -> &'static str {
        self.choices.get(key)
    }

    /// Whether an albedo above 1 was found for this variant, with amplitudes of at most 1.
    #[must_use]
    pub fn may_gain_energy(&self) -> bool {
        largest_albedo(self.model.name(), &self.choices).is_some()
    }

    /// How the lobe can be absent.
    #[must_use]
    pub fn strength(&self) -> Strength {
        if self.has_added_strength { Strength::Scale(STRENGTH) } else { self.model.strength() }
    }

    /// The coefficients of the basis and their derivatives with respect to every amplitude.
    #[doc(hidden)]
    #[must_use]
    pub fn coefficients(&self, amplitudes: &[f64]) -> LobeCoefficients {
        let Some((strength, own)) = self.split(amplitudes) else {
            return self.model.coefficients(amplitudes);
        };
        let LobeCoefficients { values, mut partials } = self.model.coefficients(own);
        partials.iter_mut().flatten().for_each(|partial| *partial *= strength);
        partials.push(values.clone());
        LobeCoefficients { values: values.iter().map(|value| strength * value).collect(), partials }
    }

    /// The BRDF at several pairs of directions, in any scalar.
    fn values_in<T: Scalar>(
        &self,
        geometries: &[Geometry<T::Real>],
        LobeValues { shapes, amplitudes }: &LobeValues<T>,
    ) -> Vec<T> {
        let Some((strength, own)) = self.split(amplitudes) else {
            return self.model.values_in(geometries, shapes, amplitudes);
        };
        self.model.values_in(geometries, shapes, own).into_iter().map(|f| strength * f).collect()
    }

    /// The strength that the sum has added, and the model's own amplitudes; `None` if it has added none.
    fn split<'a, T: Copy>(&self, amplitudes: &'a [T]) -> Option<(T, &'a [T])> {
        let (strength, own) = amplitudes.split_last().filter(|_| self.has_added_strength)?;
        Some((*strength, own))
    }

    /// The model with every choice spelled out.
    #[must_use]
    pub fn canonical(&self) -> String {
        match self.choices.text() {
            choices if choices.is_empty() => self.model.name().to_owned(),
            choices => format!("{}({choices})", self.model.name()),
        }
    }
}

/// A sum of models, and the constraints on their parameters that are written inside it.
#[derive(Clone, Debug)]
pub struct Expression {
    lobes: Vec<Lobe>,
    /// In the order of lobes and parameters.
    settings: Vec<LobeSetting>,
}

/// The values of a lobe's parameters in declared order, in formula units.
#[derive(Clone, Debug, PartialEq)]
pub struct LobeValues<T = f64> {
    /// The parameters that the basis functions depend on.
    pub shapes: Vec<T>,
    /// The parameters that the coefficients of the basis functions depend on.
    pub amplitudes: Vec<T>,
}

impl Expression {
    /// Parses an expression such as `lambert + cook-torrance(d=beckmann, g=v-cavity, m=0.2, f0=0.02..0.08, ks=free)`.
    ///
    /// Between the parentheses stand the choices of the model and constraints on its parameters: a value that fixes one, a
    /// range that bounds it, `free`, `shared`, `per-channel`, or another parameter of the lobe that it is equal to. `f0[700]` or
    /// `f0.r` is the parameter of one channel.
    ///
    /// # Errors
    /// [`Error::UnknownName`] or [`Error::Invalid`], naming the piece that is not understood.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let mut lobes: Vec<Lobe> = Vec::new();
        let mut constraints: Vec<Given> = Vec::new();
        for term in split_outside(text, '+') {
            let (name, given) = split_term(term.trim())?;
            let entry = entry_named(name)?;
            let is_choice =
                |key: &str| entry.options.iter().any(|option| option.key.eq_ignore_ascii_case(key));
            let (choice, constraint): (Given, Given) = given.into_iter().partition(|(key, _)| is_choice(key));
            let (model, choices) = entry.build(&choice)?;
            let specs = model.parameters();
            let is_parameter = |name: &str| {
                let mut names = specs.iter().map(|spec| spec.name).chain([STRENGTH]);
                names.any(|known| known.eq_ignore_ascii_case(name))
            };
            if let Some((key, _)) = constraint.iter().find(|(key, _)| !is_parameter(parameter_of(key))) {
                let keys = entry.options.iter().map(|option| option.key);
                let names: Vec<&str> = keys.chain(specs.iter().map(|spec| spec.name)).collect();
                return Err(Error::unknown(entry.name, NameKind::OptionOrParameter, &names, key));
            }
            let earlier = lobes.iter().filter(|lobe| lobe.model.name() == entry.name).count();
            let name = match earlier {
                0 => entry.name.to_owned(),
                n => format!("{}#{}", entry.name, n + 1),
            };
            lobes.push(Lobe { name, model, choices, has_added_strength: false });
            constraints.push(constraint);
        }
        if lobes.len() > 1 {
            for lobe in &mut lobes {
                lobe.has_added_strength = lobe.model.strength() == Strength::Missing;
            }
        }
        let mut expression = Self { lobes, settings: Vec::new() };
        for (index, given) in constraints.iter().enumerate() {
            expression.constrain(index, given)?;
        }
        Ok(expression)
    }

    /// The models of the sum, in the order written.
    #[must_use]
    pub fn lobes(&self) -> &[Lobe] {
        &self.lobes
    }

    /// The sum without one of its lobes; `None` if it has no other, or no such lobe. Lobes keep their names, and the strengths that
    /// the sum has given them.
    #[must_use]
    pub(crate) fn without(&self, lobe: usize) -> Option<Self> {
        let mut lobes = self.lobes.clone();
        if lobe >= lobes.len() || lobes.len() < 2 {
            return None;
        }
        lobes.remove(lobe);
        Some(Self { lobes, settings: Vec::new() })
    }

    /// The expression with every choice and every constraint spelled out.
    #[must_use]
    pub fn canonical(&self) -> String {
        let term = |(index, lobe): (usize, &Lobe)| {
            let settings = self.settings.iter().filter(|setting| setting.lobe == index);
            let inside: Vec<String> = std::iter::once(lobe.choices.text())
                .filter(|text| !text.is_empty())
                .chain(settings.map(ToString::to_string))
                .collect();
            match inside.join(", ") {
                nothing if nothing.is_empty() => lobe.model.name().to_owned(),
                inside => format!("{}({inside})", lobe.model.name()),
            }
        };
        self.lobes.iter().enumerate().map(term).collect::<Vec<_>>().join(" + ")
    }

    /// The constraints written inside the expression.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a channel that cannot be part of a name.
    pub fn settings(&self) -> Result<Settings, Error> {
        let full = |setting: &LobeSetting| {
            setting.full(self.lobes.get(setting.lobe).map_or("", |lobe| lobe.name.as_str()))
        };
        self.settings.iter().map(full).collect()
    }

    /// The same expression with other constraints written inside it.
    #[must_use]
    pub(crate) fn with_settings(&self, settings: Vec<LobeSetting>) -> Self {
        let mut expression = Self { lobes: self.lobes.clone(), settings };
        expression.sort_settings();
        expression
    }

    /// Adds the constraints written inside a term, behind those of earlier terms.
    fn constrain(&mut self, index: usize, given: &Given) -> Result<(), Error> {
        let Some(lobe) = self.lobes.get(index) else { return Ok(()) };
        let specs = lobe.parameters();
        let names: Vec<&str> = specs.iter().map(|spec| spec.name).collect();
        let mut settings = Vec::new();
        for (key, value) in given {
            let given = parameter_of(key);
            let Some(name) = names.iter().find(|name| name.eq_ignore_ascii_case(given)) else {
                return Err(Error::unknown(lobe.name.as_str(), NameKind::Parameter, &names, key));
            };
            let key = format!("{name}{}", key.get(given.len()..).unwrap_or_default());
            settings.extend(in_expression::parse(index, &lobe.name, &names, &key, value)?);
        }
        self.settings.extend(settings);
        self.sort_settings();
        Ok(())
    }

    /// Puts constraints in the order of lobes and parameters; those of one parameter keep their order.
    fn sort_settings(&mut self) {
        let place = |setting: &LobeSetting| {
            let specs = self.lobes.get(setting.lobe).map(Lobe::parameters).unwrap_or_default();
            (setting.lobe, specs.iter().position(|spec| spec.name == setting.name))
        };
        self.settings.sort_by_cached_key(place);
    }

    /// Gives `bases` one entry per lobe, and makes the slow preparations in each for the shapes of every channel. `values` holds
    /// parameter values by channel and lobe.
    #[expect(clippy::indexing_slicing, reason = "every channel has values of every lobe")]
    pub(crate) fn prepare<'a>(
        &self,
        values: &[Vec<LobeValues>],
        derivatives: impl Fn(usize) -> Derivatives<'a>,
        bases: &mut Vec<BasisBlock>,
    ) {
        bases.resize(self.lobes.len(), BasisBlock::default());
        for (index, (lobe, basis)) in self.lobes.iter().zip(bases).enumerate() {
            let of_channel = values.iter().map(|lobes| &lobes[index]);
            let shapes: Vec<&[f64]> = of_channel.map(|values| values.shapes.as_slice()).collect();
            lobe.model.prepare(&shapes, derivatives(index), basis);
        }
    }

    /// The BRDF at all `directions`, 1/sr, by channel: the values of [`Expression::value`], computed in blocks. `parameters`
    /// holds shapes and amplitudes by channel and lobe, in formula units.
    #[must_use]
    pub fn values(&self, directions: &Directions, parameters: &[Vec<LobeValues>]) -> Vec<Vec<f64>> {
        let coefficients: Vec<Vec<Vec<f64>>> = parameters
            .iter()
            .map(|lobes| {
                let of_lobe = self.lobes.iter().zip(lobes);
                of_lobe.map(|(lobe, values)| lobe.coefficients(&values.amplitudes).values).collect()
            })
            .collect();
        let mut bases = Vec::new();
        self.prepare(parameters, |_| Derivatives::None, &mut bases);
        let mut block = Block::new();
        let mut values = vec![Vec::new(); parameters.len()];
        for range in directions.blocks() {
            directions.fill(range, &mut block);
            bases.iter_mut().for_each(BasisBlock::forget);
            for ((lobes, coefficients), values) in parameters.iter().zip(&coefficients).zip(&mut values) {
                let mut sum = Row::filled(0.0);
                for (((lobe, basis), LobeValues { shapes, .. }), coefficients) in
                    self.lobes.iter().zip(&mut bases).zip(lobes).zip(coefficients)
                {
                    lobe.model.evaluate(&block, shapes, Derivatives::None, basis);
                    for (row, coefficient) in basis.values().iter().zip(coefficients) {
                        sum.iter_mut().zip(row).for_each(|(sum, value)| *sum += coefficient * value);
                    }
                }
                let seen = sum.iter().zip(block.cos_i()).zip(block.cos_o());
                let seen =
                    seen.map(|((f, cos_i), cos_o)| if *cos_i > 0.0 && *cos_o > 0.0 { *f } else { 0.0 });
                values.extend(seen.take(block.len()));
            }
        }
        values
    }

    /// The BRDF at one pair of directions, 1/sr; 0 if either direction is not above the horizon. Shapes and amplitudes of each
    /// lobe are in declared order, in formula units.
    #[must_use]
    #[expect(clippy::indexing_slicing, reason = "one pair of directions has one value")]
    pub fn value(&self, geometry: &Geometry<f64>, parameters: &[LobeValues]) -> f64 {
        self.values_in(std::slice::from_ref(geometry), parameters)[0]
    }

    /// The BRDF at several pairs of directions, in any scalar: the values of [`Expression::value`]. The crate that calls it
    /// compiles all models again for its scalar.
    #[must_use]
    pub fn values_in<T: Scalar>(
        &self,
        geometries: &[Geometry<T::Real>],
        parameters: &[LobeValues<T>],
    ) -> Vec<T> {
        assert_eq!(parameters.len(), self.lobes.len(), "one set of values per lobe");
        let zero = T::constant(0.0);
        let of_lobes =
            self.lobes.iter().zip(parameters).map(|(lobe, values)| lobe.values_in(geometries, values));
        let mut sums = of_lobes.reduce(summed).unwrap_or_else(|| vec![zero; geometries.len()]);
        for (sum, geometry) in sums.iter_mut().zip(geometries) {
            let seen = T::if_less(zero.value(), geometry.cos_o(), *sum, zero);
            *sum = T::if_less(zero.value(), geometry.cos_i(), seen, zero);
        }
        sums
    }
}

impl std::str::FromStr for Expression {
    type Err = Error;
    fn from_str(text: &str) -> Result<Self, Error> {
        Self::parse(text)
    }
}

/// Choices as written: pairs of option and value.
type Given = Vec<(String, String)>;

fn entry_named(name: &str) -> Result<&'static ModelEntry, Error> {
    REGISTRY.iter().find(|entry| entry.name.eq_ignore_ascii_case(name)).ok_or_else(|| {
        let names: Vec<&str> = REGISTRY.iter().map(|entry| entry.name).collect();
        Error::unknown("model", NameKind::Model, &names, name)
    })
}

/// The pieces of a text between separators that do not stand in parentheses or brackets.
fn split_outside(text: &str, separator: char) -> Vec<&str> {
    let mut depth = 0_usize;
    let mut pieces = Vec::new();
    let mut start = 0;
    for (place, c) in text.char_indices() {
        match c {
            '(' | '[' => depth += 1,
            ')' | ']' => depth = depth.saturating_sub(1),
            c if c == separator && depth == 0 => {
                pieces.push(text.get(start..place).unwrap_or_default());
                start = place + c.len_utf8();
            }
            _ => {}
        }
    }
    pieces.push(text.get(start..).unwrap_or_default());
    pieces
}

/// Splits `name(key=value, key=value)`.
fn split_term(term: &str) -> Result<(&str, Given), Error> {
    let wrong = |expected: &str| Err(Error::invalid("model", expected, excerpt(term)));
    let Some((name, rest)) = term.split_once('(') else {
        return if term.is_empty() || term.contains(')') {
            wrong("terms such as 'lambert' or 'cook-torrance(d=ggx)' joined by '+'")
        } else {
            Ok((term, Vec::new()))
        };
    };
    let Some(inside) = rest.strip_suffix(')') else {
        return wrong("')' at the end of the term");
    };
    let mut given = Vec::new();
    if !inside.trim().is_empty() {
        for choice in split_outside(inside, ',') {
            let Some((key, value)) = choice.split_once('=') else {
                return wrong("choices and constraints such as 'd=ggx' or 'm=0.2' between the parentheses");
            };
            given.push((key.trim().to_owned(), value.trim().to_owned()));
        }
    }
    Ok((name.trim(), given))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn canonical_form_is_a_fixed_point() {
        let text = "lambert+cook-torrance ( f=none )+ cook-torrance";
        let expression = Expression::parse(text).unwrap();
        let canonical = expression.canonical();
        assert_eq!(
            canonical,
            "lambert + cook-torrance(d=ggx, g=smith, f=none) + cook-torrance(d=ggx, g=smith, f=schlick)"
        );
        assert_eq!(Expression::parse(&canonical).unwrap().canonical(), canonical);
        assert_eq!(expression.lobes()[2].name, "cook-torrance#2");
    }

    #[test]
    fn constraints_are_part_of_the_expression() {
        let text = "lambert(kd.r=0.25) + cook-torrance(f0[700]=0.05, m=0.1..0.5, ks=free, d=ggx) \
                    + ashikhmin-shirley(nv=nu, strength=0.5, rs=1e+0)";
        let expression = Expression::parse(text).unwrap();
        let canonical = expression.canonical();
        assert_eq!(
            canonical,
            "lambert(kd.r=0.25) + cook-torrance(d=ggx, g=smith, f=schlick, m=0.1..0.5, f0[700]=0.05, ks=free) \
             + ashikhmin-shirley(rs=1, nv=nu, strength=0.5)"
        );
        assert_eq!(Expression::parse(&canonical).unwrap().canonical(), canonical);
        assert_eq!(expression.settings().unwrap().len(), 7);
        // A metal's name is its colour.
        let gold = Expression::parse("cook-torrance(f0=gold)").unwrap();
        assert_eq!(gold.settings().unwrap().len(), 3);
        assert!(gold.canonical().contains("f0.r="), "{}", gold.canonical());
    }

    /// A key would be ambiguous if it named both.
    #[test]
    fn no_parameter_has_the_name_of_an_option() {
        for entry in REGISTRY {
            for (model, _) in entry.variants() {
                for spec in model.parameters() {
                    assert!(entry.options.iter().all(|option| option.key != spec.name), "{}", entry.name);
                }
            }
        }
    }

    #[test]
    fn mistakes_are_named() {
        for (text, words) in [
            ("", "joined by '+'"),
            ("lambert +", "joined by '+'"),
            ("lambrt", "found 'lambrt'"),
            ("lambert(d=ggx)", "found 'd'"),
            ("lambert(kd=nan)", "with numbers"),
            ("lambert(kd=0.5..)", "with numbers"),
            ("cook-torrance(f0.a\u{8}b=1)", "a channel's name"),
            ("cook-torrance(p=1)", "an option or a parameter"),
            ("cook-torrance(f0[700=0.2)", "expected a name"),
            ("cook-torrance(d=ggy)", "found 'ggy'"),
            ("cook-torrance(d=ggx, d=ggx)", "found it twice"),
            ("cook-torrance(ggx)", "choices and constraints such as"),
            ("cook-torrance(d=ggx", "')' at the end"),
        ] {
            let message = Expression::parse(text).unwrap_err().to_string();
            assert!(message.contains(words), "{text}: {message}");
            assert!(!message.contains(char::is_control), "{message:?}");
        }
    }
}
