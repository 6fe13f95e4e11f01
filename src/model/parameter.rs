//! The description of a model's parameters.

/// The unit that a parameter is given and reported in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Unit {
    /// Dimensionless.
    One,
    /// Degrees for the user, radians in the formulas.
    Degrees,
    /// The unit of MERL values before the scales of the three channels are applied, which some published tables use. The
    /// scales are (1, 1.15, 1.66) for r, g, b, without the common 1/1500.
    UnscaledMerl,
}

impl Unit {
    /// The unit as reports write it.
    #[must_use]
    pub fn symbol(self) -> &'static str {
        match self {
            Self::One => "1",
            Self::Degrees => "deg",
            Self::UnscaledMerl => "unscaled MERL",
        }
    }

    /// The number of formula units in one reported unit, for a parameter of this channel. `None` means all channels.
    #[must_use]
    pub fn factor(self, channel: Option<usize>) -> f64 {
        match (self, channel) {
            (Self::Degrees, _) => std::f64::consts::PI / 180.0,
            (Self::UnscaledMerl, Some(1)) => 1.15,
            (Self::UnscaledMerl, Some(2)) => 1.66,
            (Self::One | Self::UnscaledMerl, _) => 1.0,
        }
    }
}

/// The way in which a parameter enters the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// It enters only the coefficients of the basis; in most models linear least squares finds it.
    Amplitude,
    /// It enters the basis functions themselves.
    Shape,
}

/// Whether the channels of a measurement share a parameter by default.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sharing {
    /// One value for all channels.
    Shared,
    /// One value per channel.
    PerChannel,
}

/// The coordinate in which the solver moves a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// The parameter itself.
    Linear,
    /// Its logarithm, for positive quantities that span decades.
    Log,
    /// Its square, for quantities that enter the model only as squares. At 0 the derivative with respect to the parameter
    /// itself is 0, so a fit that reached 0 could not leave it.
    Square,
}

/// The value at which a parameter leaves its model isotropic.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Isotropy {
    /// The value of this parameter of the same model.
    As(&'static str),
    /// This value, in the parameter's unit.
    At(f64),
}

/// Whether small or large values of a parameter make its lobe sharper.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sharper {
    /// Small values make it sharper, as for a roughness.
    Smaller,
    /// Large values make it sharper, as for an exponent.
    Larger,
}

/// One parameter of a model: everything that the rest of the program needs to know about it.
///
/// Values are in the reported [`Unit`].
#[derive(Clone, Debug)]
pub struct ParamSpec {
    /// The symbol, as used in the literature, on the command line and in reports.
    pub name: &'static str,
    /// The meaning, in a few words.
    pub summary: &'static str,
    /// Unit of all values here.
    pub unit: Unit,
    /// Smallest and largest value.
    pub bounds: (f64, f64),
    /// The value at which a fit starts if nothing better is known.
    pub initial: f64,
    /// The range that the search for a start scans.
    pub typical: (f64, f64),
    /// Whether the search for a start scans it. If not, it starts at `initial`.
    pub scanned: bool,
    /// Whether it is fixed at `initial` unless freed.
    pub fixed: bool,
    /// Amplitude or shape.
    pub role: Role,
    /// Shared or per channel.
    pub sharing: Sharing,
    /// Linear, logarithmic or square.
    pub scale: Scale,
    /// The value at which this parameter leaves the model isotropic, and at which it is held if the data cannot tell an anisotropic
    /// material from an isotropic one. `None` if it does not make the model anisotropic.
    pub isotropy: Option<Isotropy>,
    /// How this parameter sorts lobes of one kind, sharpest first. `None` if it does not sort them.
    pub sharper: Option<Sharper>,
    /// Whether it is the share of light that a surface reflects, which is at most 1 on every surface.
    pub is_albedo: bool,
}

/// The largest albedo that a fit tries: more than any surface has, since the scale of a measurement may be wrong.
const LARGEST_ALBEDO: f64 = 2.0;

impl ParamSpec {
    /// A per-channel albedo.
    #[must_use]
    pub const fn albedo(name: &'static str, summary: &'static str, initial: f64) -> Self {
        Self { is_albedo: true, ..Self::amplitude(name, summary, LARGEST_ALBEDO, initial) }
    }

    /// A per-channel amplitude between 0 and `upper`.
    #[must_use]
    pub const fn amplitude(name: &'static str, summary: &'static str, upper: f64, initial: f64) -> Self {
        Self {
            name,
            summary,
            unit: Unit::One,
            bounds: (0.0, upper),
            initial,
            typical: (0.0, upper),
            scanned: true,
            fixed: false,
            role: Role::Amplitude,
            sharing: Sharing::PerChannel,
            scale: Scale::Linear,
            isotropy: None,
            sharper: None,
            is_albedo: false,
        }
    }

    /// A dimensionless shape parameter shared by the channels.
    #[must_use]
    pub const fn shape(
        name: &'static str,
        summary: &'static str,
        bounds: (f64, f64),
        typical: (f64, f64),
        initial: f64,
        scale: Scale,
    ) -> Self {
        Self {
            name,
            summary,
            unit: Unit::One,
            bounds,
            initial,
            typical,
            scanned: true,
            fixed: false,
            role: Role::Shape,
            sharing: Sharing::Shared,
            scale,
            isotropy: None,
            sharper: None,
            is_albedo: false,
        }
    }

    /// Converts a value that applies to all channels to the unit of the formulas.
    #[must_use]
    pub fn in_formula_units(&self, value: f64) -> f64 {
        value * self.unit.factor(None)
    }

    /// The same parameter with one value per channel.
    #[must_use]
    pub const fn per_channel(self) -> Self {
        Self { sharing: Sharing::PerChannel, ..self }
    }

    /// The same parameter, which the search for a start leaves at its initial value.
    #[must_use]
    pub const fn unscanned(self) -> Self {
        Self { scanned: false, ..self }
    }

    /// The same parameter, fixed unless freed.
    #[must_use]
    pub const fn fixed(self) -> Self {
        Self { fixed: true, ..self }
    }

    /// The same parameter, which leaves the model isotropic if it equals `other`, a parameter of the same model.
    #[must_use]
    pub const fn isotropic_as(self, other: &'static str) -> Self {
        Self { isotropy: Some(Isotropy::As(other)), ..self }
    }

    /// The same parameter, which leaves the model isotropic at `value`.
    #[must_use]
    pub const fn isotropic_at(self, value: f64) -> Self {
        Self { isotropy: Some(Isotropy::At(value)), ..self }
    }

    /// The same parameter, used to sort lobes of one kind.
    #[must_use]
    pub const fn sharper_when(self, sharper: Sharper) -> Self {
        Self { sharper: Some(sharper), ..self }
    }

    /// The same parameter in another unit.
    #[must_use]
    pub const fn unit(self, unit: Unit) -> Self {
        Self { unit, ..self }
    }
}
