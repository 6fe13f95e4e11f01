//! What a model says about its parameters.

/// The unit that a parameter is given and reported in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Unit {
    /// Dimensionless.
    One,
    /// Degrees outside, radians inside the formulas.
    Degrees,
    /// The unit of MERL values before the scale of each of the three channels is applied, as some published tables
    /// have it: (1, 1.15, 1.66) for r, g, b, without the common 1/1500.
    UnscaledMerl,
}

impl Unit {
    /// How reports write it.
    #[must_use]
    pub fn symbol(self) -> &'static str {
        match self {
            Self::One => "1",
            Self::Degrees => "deg",
            Self::UnscaledMerl => "unscaled MERL",
        }
    }

    /// The number of formula units in one reported unit, for a parameter of a channel or of all.
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

/// How a parameter enters the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Only through the coefficients of the basis: solved by linear least squares in most models.
    Amplitude,
    /// Through the basis functions themselves.
    Shape,
}

/// Whether the channels of a measurement share a parameter unless told otherwise.
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
    /// Its square, for quantities of which the model knows nothing else. At 0 their own derivative is 0,
    /// whichever way the cost goes, and a fit that came there would stay.
    Square,
}

/// Which values of a parameter make its lobe sharper.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sharper {
    /// Small ones: a roughness.
    Smaller,
    /// Large ones: an exponent.
    Larger,
}

/// One parameter of a model: the whole contract between the formula and every tool.
///
/// Values are in the reported [`Unit`].
#[derive(Clone, Debug)]
pub struct ParamSpec {
    /// The field's symbol, as on the command line and in reports.
    pub name: &'static str,
    /// What it is, in a few words.
    pub summary: &'static str,
    /// Unit of all values here.
    pub unit: Unit,
    /// Smallest and largest value.
    pub bounds: (f64, f64),
    /// Where a fit starts when nothing better is known.
    pub initial: f64,
    /// The range that the search for a start scans.
    pub typical: (f64, f64),
    /// Whether the search for a start scans it; otherwise it starts at `initial`.
    pub scanned: bool,
    /// Whether it is fixed at `initial` unless freed.
    pub fixed: bool,
    /// Amplitude or shape.
    pub role: Role,
    /// Shared or per channel.
    pub sharing: Sharing,
    /// Linear or logarithmic.
    pub scale: Scale,
    /// The parameter of the same model that this one equals on data that do not know the half vector's
    /// azimuth.
    pub isotropic_as: Option<&'static str>,
    /// Whether lobes of one kind are put in order by this parameter, the sharpest first, and how.
    pub sharper: Option<Sharper>,
}

impl ParamSpec {
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
            isotropic_as: None,
            sharper: None,
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
            isotropic_as: None,
            sharper: None,
        }
    }

    /// A value of this parameter, one for all channels, in the unit of the formulas.
    #[must_use]
    pub fn in_formula_units(&self, value: f64) -> f64 {
        value * self.unit.factor(None)
    }

    /// The same parameter with one value per channel.
    #[must_use]
    pub const fn per_channel(self) -> Self {
        Self { sharing: Sharing::PerChannel, ..self }
    }

    /// The same parameter, left at its initial value by the search for a start.
    #[must_use]
    pub const fn unscanned(self) -> Self {
        Self { scanned: false, ..self }
    }

    /// The same parameter, fixed unless freed.
    #[must_use]
    pub const fn fixed(self) -> Self {
        Self { fixed: true, ..self }
    }

    /// The same parameter, equal to `other` on data that do not know the half vector's azimuth.
    #[must_use]
    pub const fn isotropic_as(self, other: &'static str) -> Self {
        Self { isotropic_as: Some(other), ..self }
    }

    /// The same parameter, putting lobes of one kind in order.
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
