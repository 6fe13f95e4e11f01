//! What the name of a column says about it. docs/use/formats.md lists the names that are known.

use crate::measurement::Channel;
use crate::measurement::reading::{Angle, AngleUnit};

/// What a column is, by its name.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Role {
    /// An angle, and its unit if the name has one.
    Angle(Angle, Option<AngleUnit>),
    /// A polar angle of the light if the table has one of the viewer, and the other way round.
    OtherPolarAngle(Option<AngleUnit>),
    /// The wavelength of the row, and nanometres per unit if the name has a unit.
    Wavelength(Option<f64>),
    /// Standard deviations.
    Deviation(Deviation),
    /// Neither a value nor a direction; the reason in words.
    Other(&'static str),
    /// Values of a channel.
    Value {
        /// The channel that the name says.
        channel: Channel,
        /// What the name says about the values, if they may be something else than f.
        doubt: Option<&'static str>,
    },
}

/// What a name says about standard deviations.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Deviation {
    /// Whose they are; `None` for all channels.
    pub(super) of: Option<String>,
    /// Whether the name begins with `sigma`, which nothing else does.
    pub(super) certain: bool,
    /// Standard deviations per unit: 1/2 for an expanded uncertainty of k = 2, 1/100 for per cent.
    pub(super) factor: f64,
    /// Whether they are relative to the value.
    pub(super) relative: bool,
}

/// Words for what is measured from the normal.
const POLAR: [&str; 8] =
    ["theta", "zenith", "polar", "inclination", "colatitude", "zenithangle", "polarangle", "vartheta"];
/// Words for its cosine.
const COSINE: [&str; 4] = ["costheta", "cos", "mu", "cosine"];
/// Words for the angle to the surface.
const ELEVATION: [&str; 3] = ["elevation", "elev", "altitude"];
/// Words for a turn about the normal.
const AZIMUTH: [&str; 7] = ["phi", "azimuth", "azimuthal", "azim", "azi", "az", "varphi"];
/// Words for the light.
const LIGHT: [&str; 19] = [
    "i",
    "in",
    "inc",
    "incident",
    "incidence",
    "incoming",
    "l",
    "light",
    "lamp",
    "source",
    "src",
    "illumination",
    "illum",
    "illuminant",
    "irradiation",
    "sun",
    "solar",
    "0",
    "incidentlight",
];
/// Words for the viewer.
const VIEWER: [&str; 34] = [
    "o",
    "out",
    "outgoing",
    "r",
    "refl",
    "reflected",
    "reflection",
    "v",
    "view",
    "viewing",
    "viewer",
    "obs",
    "observation",
    "observer",
    "observed",
    "det",
    "detector",
    "detection",
    "rec",
    "receiver",
    "sensor",
    "camera",
    "cam",
    "measure",
    "measured",
    "measurement",
    "meas",
    "e",
    "exit",
    "emission",
    "emergent",
    "emergence",
    "scatter",
    "scattered",
];
/// Words that make an azimuth one between both directions.
const RELATIVE: [&str; 7] = ["rel", "relative", "delta", "diff", "difference", "between", "d"];
/// Abbreviations of remote sensing and scatterometry.
const ABBREVIATIONS: [(&str, Angle); 12] = [
    ("sza", Angle::ThetaI),
    ("iza", Angle::ThetaI),
    ("aoi", Angle::ThetaI),
    ("incidence", Angle::ThetaI),
    ("vza", Angle::ThetaO),
    ("oza", Angle::ThetaO),
    ("saa", Angle::PhiI),
    ("iaa", Angle::PhiI),
    ("vaa", Angle::PhiO),
    ("oaa", Angle::PhiO),
    ("raa", Angle::Phi),
    ("dphi", Angle::Phi),
];
/// Words for a wavelength.
const WAVELENGTH: [&str; 6] = ["wavelength", "wavelengths", "lambda", "wl", "wvl", "lam"];
/// Words for a standard deviation.
const DEVIATION: [&str; 15] = [
    "sigma",
    "uncertainty",
    "uncertainties",
    "uncert",
    "unc",
    "u",
    "std",
    "stdev",
    "stddev",
    "sd",
    "sem",
    "standarddeviation",
    "standarduncertainty",
    "error",
    "err",
];
/// Words for what is no reflectance, and what it is.
const OTHERS: [(&str, &str); 37] = [
    ("no", "row numbers"),
    ("nr", "row numbers"),
    ("n", "row numbers"),
    ("num", "row numbers"),
    ("number", "row numbers"),
    ("index", "row numbers"),
    ("idx", "row numbers"),
    ("id", "row numbers"),
    ("row", "row numbers"),
    ("rownumber", "row numbers"),
    ("line", "row numbers"),
    ("point", "row numbers"),
    ("pt", "row numbers"),
    ("pos", "row numbers"),
    ("count", "counts"),
    ("counts", "counts"),
    ("time", "times"),
    ("timestamp", "times"),
    ("date", "times"),
    ("datetime", "times"),
    ("t", "times"),
    ("temperature", "temperatures"),
    ("temp", "temperatures"),
    ("humidity", "humidities"),
    ("pressure", "pressures"),
    ("comment", "remarks"),
    ("comments", "remarks"),
    ("note", "remarks"),
    ("notes", "remarks"),
    ("remark", "remarks"),
    ("remarks", "remarks"),
    ("file", "names"),
    ("filename", "names"),
    ("operator", "names"),
    ("exposure", "settings"),
    ("gain", "settings"),
    ("integrationtime", "settings"),
];
/// Words for values that are not f, and what they are.
const NOT_F: [(&str, &str); 10] = [
    ("brf", "a reflectance factor"),
    ("hdrf", "a reflectance factor"),
    ("hcrf", "a reflectance factor"),
    ("rf", "a reflectance factor"),
    ("reflectancefactor", "a reflectance factor"),
    ("radiancefactor", "a reflectance factor"),
    ("ccbrdf", "f times a cosine"),
    ("brdfcos", "f times a cosine"),
    ("fcos", "f times a cosine"),
    ("db", "decibels"),
];

/// The wavelength that a number of units is, nanometres, without what rounding adds to a decimal fraction.
pub(super) fn wavelength(number: f64, nanometres_per_unit: f64) -> f64 {
    if nanometres_per_unit == 1.0 {
        return number;
    }
    let product = number * nanometres_per_unit;
    format!("{product:.9e}").parse().unwrap_or(product)
}

/// Nanometres per unit of length.
fn nanometres(unit: &str) -> Option<f64> {
    Some(match unit {
        "nm" | "nanometer" | "nanometers" | "nanometre" | "nanometres" => 1.0,
        "um" | "µm" | "μm" | "micron" | "microns" | "micrometer" | "micrometers" | "micrometre"
        | "micrometres" => 1e3,
        "mm" => 1e6,
        "m" => 1e9,
        "a" | "å" | "angstrom" | "angstroms" => 0.1,
        _ => return None,
    })
}

/// A unit of an angle.
fn angle_unit(unit: &str) -> Option<AngleUnit> {
    Some(match unit {
        "deg" | "degs" | "degree" | "degrees" | "°" | "º" => AngleUnit::Degrees,
        "rad" | "rads" | "radian" | "radians" => AngleUnit::Radians,
        "gon" | "grad" | "grads" | "gradian" | "gradians" => AngleUnit::Gradians,
        _ => return None,
    })
}

/// Whether a text in brackets is a unit that says nothing new about a value.
fn is_plain_unit(unit: &str) -> bool {
    let plain: String = unit.chars().filter(|c| !c.is_whitespace()).collect();
    matches!(
        plain.as_str(),
        "1/sr" | "/sr" | "sr-1" | "sr^-1" | "sr^(-1)" | "sr⁻¹" | "-" | "1" | "a.u." | "au"
    )
}

/// Whether a field of a row is a unit, as in a line of units below the header.
pub(super) fn is_unit(field: &str) -> bool {
    let unit = field.trim_matches(|c: char| "[]()".contains(c)).trim().to_lowercase();
    unit.is_empty()
        || angle_unit(&unit).is_some()
        || nanometres(&unit).is_some()
        || is_plain_unit(&unit)
        || matches!(
            unit.as_str(),
            "%" | "percent" | "per cent" | "db" | "sr" | "s" | "c" | "°c" | "k" | "none" | "unitless"
        )
}

/// A name in lower case, its words, and its unit.
struct Parsed {
    words: Vec<String>,
    /// The text in brackets at its end, or its last word if that is a unit of an angle or a length.
    unit: Option<String>,
    /// The name without brackets at its end.
    base: String,
}

impl Parsed {
    fn new(name: &str) -> Self {
        let (mut base, mut unit) = (name.trim(), None);
        for (open, close) in [('[', ']'), ('(', ')')] {
            if let Some((before, inside)) = base.strip_suffix(close).and_then(|rest| rest.rsplit_once(open)) {
                (base, unit) = (before.trim(), Some(inside.trim().to_lowercase()));
                break;
            }
        }
        let mut words = words(base);
        if unit.is_none() && words.len() > 1 {
            unit = words.pop_if(|word| angle_unit(word).is_some() || nanometres(word).is_some());
        }
        // What stands in brackets may be part of the name, as in `theta (incident)`.
        if let Some(inside) = unit.as_ref().filter(|unit| !is_unit(unit)) {
            words.extend(self::words(inside));
        }
        Self { words, unit, base: base.to_owned() }
    }

    fn glued(&self) -> String {
        self.words.concat()
    }

    fn has(&self, wanted: &[&str]) -> bool {
        self.words.iter().any(|word| wanted.contains(&word.as_str()))
    }
}

/// The words of a name in lower case: parts between other characters, from a capital after a small letter on, and Greek letters by name.
fn words(name: &str) -> Vec<String> {
    let (mut words, mut word) = (Vec::new(), String::new());
    let mut end = |word: &mut String| {
        if !word.is_empty() {
            words.push(std::mem::take(word));
        }
    };
    let mut after_small = false;
    for c in name.chars() {
        let greek = match c {
            'θ' | 'ϑ' | 'Θ' => "theta",
            'φ' | 'ϕ' | 'Φ' => "phi",
            'λ' | 'Λ' => "lambda",
            'σ' | 'Σ' => "sigma",
            'Δ' | 'δ' | '∆' => "delta",
            'μ' | 'µ' => "mu",
            _ => "",
        };
        let subscript = match c {
            'ᵢ' => "i",
            'ₒ' => "o",
            'ᵣ' => "r",
            'ᵥ' => "v",
            '₀' => "0",
            _ => "",
        };
        if !greek.is_empty() || !subscript.is_empty() {
            end(&mut word);
            word.push_str(greek);
            word.push_str(subscript);
            end(&mut word);
        } else if c.is_alphanumeric() {
            if c.is_uppercase() && after_small {
                end(&mut word);
            }
            word.extend(c.to_lowercase());
        } else {
            end(&mut word);
        }
        after_small = c.is_lowercase() && greek.is_empty();
    }
    end(&mut word);
    words
}

/// What follows or precedes one of `stems` in a name that is glued together.
fn beside<'n>(glued: &'n str, stems: &[&str]) -> Vec<&'n str> {
    let rest = |stem: &&str| [glued.strip_prefix(*stem), glued.strip_suffix(*stem)];
    stems.iter().flat_map(rest).flatten().collect()
}

/// The angle that a name stands for, and the unit that its words imply.
fn angle(parsed: &Parsed) -> Option<Role> {
    let unit = parsed.unit.as_deref().and_then(angle_unit);
    // The words that say nothing by themselves.
    let filler = ["angle", "angles", "of", "the", "direction", "ray"];
    let is_named_angle = parsed.has(&["angle", "angles"]);
    let glued: String =
        parsed.words.iter().filter(|word| !filler.contains(&word.as_str())).map(String::as_str).collect();
    if let Some((_, angle)) = ABBREVIATIONS.iter().find(|(name, _)| *name == glued) {
        return Some(Role::Angle(*angle, unit));
    }
    let mut polar: Vec<(&str, Option<AngleUnit>)> = Vec::new();
    polar.extend(beside(&glued, &POLAR).into_iter().map(|side| (side, unit)));
    polar.extend(beside(&glued, &COSINE).into_iter().map(|side| (side, Some(AngleUnit::Cosine))));
    polar.extend(beside(&glued, &ELEVATION).into_iter().map(|side| (side, Some(AngleUnit::Elevation))));
    if is_named_angle {
        polar.push((glued.as_str(), unit));
    }
    for (side, unit) in &polar {
        if LIGHT.contains(side) {
            return Some(Role::Angle(Angle::ThetaI, *unit));
        }
        if VIEWER.contains(side) {
            return Some(Role::Angle(Angle::ThetaO, *unit));
        }
    }
    // theta_s is the sun's for some and the scattered light's for others.
    if let Some((_, unit)) = polar.iter().find(|(side, _)| matches!(*side, "s" | "")) {
        let is_polar = glued.starts_with("theta") || glued.ends_with("zenith") || glued.starts_with("polar");
        return is_polar.then_some(Role::OtherPolarAngle(*unit));
    }
    for side in beside(&glued, &AZIMUTH) {
        let angle = if LIGHT.contains(&side) {
            Angle::PhiI
        } else if VIEWER.contains(&side) {
            Angle::PhiO
        } else if side.is_empty() || (RELATIVE.contains(&side) && glued != "phid") {
            Angle::Phi
        } else {
            continue;
        };
        return Some(Role::Angle(angle, unit));
    }
    // What remains speaks of directions, but of none of the four angles: the half vector's, or one in another frame.
    let speaks_of_angles = is_named_angle
        || parsed.has(&["theta", "phi", "zenith", "azimuth", "elevation"])
        || ["thetah", "thetad", "phih", "phid"].contains(&glued.as_str());
    speaks_of_angles.then_some(Role::Other("an angle that is not one of those that are read"))
}

/// The standard deviations that a name stands for.
fn deviation(parsed: &Parsed, name: &str) -> Option<Role> {
    // What this project writes means what it says, whatever the channel is called.
    if name == "sigma" || name.strip_prefix("sigma_").is_some_and(|of| !of.is_empty()) {
        return Some(exact_role(name));
    }
    let lower = name.to_lowercase();
    let squeezed: String = lower.chars().filter(|c| !c.is_whitespace()).collect();
    let expanded = ["k=2", "2sigma", "2-sigma", "2σ"].iter().any(|mark| squeezed.contains(mark));
    let per_cent = matches!(parsed.unit.as_deref(), Some("%" | "percent" | "per cent"));
    let relative = per_cent || parsed.has(&["rel", "relative"]);
    let factor = if per_cent { 0.01 } else { 1.0 } * if expanded { 0.5 } else { 1.0 };
    let found = |of: Option<&str>| {
        let of = of.map(|of| of.trim_matches(|c: char| " _-.()[]".contains(c)).to_owned());
        let of = of.filter(|of| !of.is_empty());
        Some(Role::Deviation(Deviation { of, certain: false, factor, relative }))
    };
    let filler = [
        "rel",
        "relative",
        "k",
        "2",
        "2sigma",
        "expanded",
        "standard",
        "of",
        "the",
        "measurement",
        "combined",
    ];
    let meant: Vec<&str> =
        parsed.words.iter().map(String::as_str).filter(|word| !filler.contains(word)).collect();
    if DEVIATION.contains(&parsed.glued().as_str()) || meant == ["deviation"] {
        return found(None);
    }
    match meant.as_slice() {
        [only] if DEVIATION.contains(only) => return found(None),
        _ => {}
    }
    let separators = |c: char| "_ -.(".contains(c);
    let base = parsed.base.as_str();
    let is = |word: &str| DEVIATION.contains(&word.to_lowercase().as_str());
    // A name in brackets at the end is the channel: u(r).
    if let Some(inside) = parsed.unit.as_deref().filter(|unit| is(base) && !is_unit(unit)) {
        let of = name.rsplit_once(['(', '[']).map_or(inside, |(_, of)| of);
        return found(Some(of));
    }
    let first = base.split_once(separators).filter(|(word, _)| is(word)).map(|(_, of)| of);
    let last = || base.rsplit_once(separators).filter(|(_, word)| is(word)).map(|(of, _)| of);
    first.or_else(last).and_then(|of| found(Some(of)))
}

/// The wavelength in a name, nanometres: a number before nanometres or micrometres, which may stand in brackets.
fn wavelength_in(name: &str) -> Option<f64> {
    let is_number = |c: char| c.is_ascii_digit() || c == '.';
    let mut rest = name;
    while let Some(at) = rest.find(|c: char| c.is_ascii_digit()) {
        let (_, from) = rest.split_at(at);
        let end = from.find(|c: char| !is_number(c)).unwrap_or(from.len());
        let (digits, after) = from.split_at(end);
        let unit = after.trim_start_matches([' ', '[', '(']);
        let unit = unit.split(|c: char| !c.is_alphabetic()).next().unwrap_or_default().to_lowercase();
        let factor = nanometres(&unit).filter(|factor| *factor == 1.0 || *factor == 1e3);
        if let (Some(factor), Ok(number)) = (factor, digits.parse()) {
            return Some(wavelength(number, factor));
        }
        rest = after;
    }
    None
}

/// The channel and the doubt about its values that a name stands for.
fn value(parsed: &Parsed, name: &str) -> Role {
    let unit = parsed.unit.as_deref();
    let in_brackets = name.trim_end().ends_with([']', ')']);
    let mut doubt =
        NOT_F.iter().find(|(word, _)| parsed.has(&[*word]) || parsed.glued() == *word).map(|(_, what)| *what);
    doubt = match unit {
        Some("%" | "percent" | "per cent") => Some("per cent"),
        Some("db") => Some("decibels"),
        Some(unit) if unit.contains("cos") => Some("f times a cosine"),
        _ => doubt,
    };
    // Channel::named knows numbers alone and those before nm.
    if Channel::named(name).wavelength_nm.is_none()
        && let Some(nm) = wavelength_in(name).filter(|nm| nm.is_finite() && *nm > 0.0)
    {
        return Role::Value { channel: Channel::at_wavelength(nm), doubt };
    }
    let plain =
        if in_brackets && unit.is_some_and(is_unit) && !parsed.base.is_empty() { &parsed.base } else { name };
    Role::Value { channel: Channel::named(plain.trim()), doubt }
}

/// What a column of this name is in a table of this project whose channels have names that would be taken for something else.
pub(super) fn exact_role(name: &str) -> Role {
    if let Some(angle) = Angle::ALL.into_iter().find(|angle| *angle != Angle::Phi && angle.name() == name) {
        return Role::Angle(angle, None);
    }
    let of =
        if name == "sigma" { Some(None) } else { name.strip_prefix("sigma_").map(|of| Some(of.to_owned())) };
    match of {
        Some(of) => Role::Deviation(Deviation { of, certain: true, factor: 1.0, relative: false }),
        None => Role::Value { channel: Channel::named(name), doubt: None },
    }
}

/// What a column of this name is.
pub(super) fn role(name: &str) -> Role {
    if let Some(exact) = Angle::ALL.into_iter().find(|angle| angle.name() == name) {
        return Role::Angle(exact, None);
    }
    let parsed = Parsed::new(name);
    let glued = parsed.glued();
    if WAVELENGTH.contains(&glued.as_str()) {
        return Role::Wavelength(parsed.unit.as_deref().and_then(nanometres));
    }
    if let Some(role) = angle(&parsed).or_else(|| deviation(&parsed, name)) {
        return role;
    }
    let first = parsed.words.first().map(String::as_str).unwrap_or_default();
    let other = |(word, _): &&(&str, &str)| *word == glued || (*word == first && word.len() > 3);
    match OTHERS.iter().find(other) {
        Some((_, what)) => Role::Other(what),
        None => value(&parsed, name),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is(names: &[&str], expected: &Role) {
        for name in names {
            assert_eq!(&role(name), expected, "{name}");
        }
    }

    #[test]
    fn angles_by_many_names() {
        let plain = |angle| Role::Angle(angle, None);
        let names = [
            "theta_i",
            "thetaI",
            "Theta_i",
            "theta_in",
            "theta_inc",
            "THETA_I",
            "thetai",
            "inc_zenith",
            "sza",
            "SZA",
            "θi",
            "θ_i",
            "θᵢ",
            "Incident_angle",
            "Incident Zenith",
            "angle of incidence",
            "AOI",
            "solar zenith angle",
            "theta_l",
            "source_theta",
            "theta (incident)",
            "illumination zenith",
            "zenith_i",
            "polar_in",
            "theta0",
        ];
        is(&names, &plain(Angle::ThetaI));
        let names = [
            "theta_o",
            "thetaR",
            "theta_r",
            "theta_v",
            "theta_out",
            "Viewing Zenith",
            "vza",
            "Measure_angle",
            "detector angle",
            "θr",
            "view_zenith",
            "theta_det",
            "reflected angle",
            "observation_angle",
            "theta-refl",
            "Θ_o",
        ];
        is(&names, &plain(Angle::ThetaO));
        is(
            &["phi_i", "phiIn", "saa", "inc_azimuth", "Solar Azimuth", "φ_i", "azimuth_in", "azi_i"],
            &plain(Angle::PhiI),
        );
        is(
            &["phi_o", "phi_r", "phiV", "vaa", "view azimuth", "ϕo", "azimuth_out", "sensor_azimuth_angle"],
            &plain(Angle::PhiO),
        );
        is(
            &[
                "phi",
                "raa",
                "Relative Azimuth",
                "delta_phi",
                "Δφ",
                "dphi",
                "relative_azimuth_angle",
                "azimuth",
            ],
            &plain(Angle::Phi),
        );
        is(&["theta_s", "theta", "zenith"], &Role::OtherPolarAngle(None));
    }

    #[test]
    fn units_of_angles_stand_in_the_name() {
        for name in ["theta_i [rad]", "theta_i_rad", "theta_i(radians)", "thetaI rad"] {
            assert_eq!(role(name), Role::Angle(Angle::ThetaI, Some(AngleUnit::Radians)), "{name}");
        }
        is(
            &["theta_o [deg]", "theta_o (°)", "Viewing Zenith [deg]", "theta_o_deg"],
            &Role::Angle(Angle::ThetaO, Some(AngleUnit::Degrees)),
        );
        is(
            &["cos_theta_i", "mu_i", "mu0", "cosThetaI"],
            &Role::Angle(Angle::ThetaI, Some(AngleUnit::Cosine)),
        );
        is(&["elevation_out", "view_elevation"], &Role::Angle(Angle::ThetaO, Some(AngleUnit::Elevation)));
        is(&["phi_r [gon]"], &Role::Angle(Angle::PhiO, Some(AngleUnit::Gradians)));
    }

    #[test]
    fn standard_deviations_name_their_channel() {
        let deviation = |of: Option<&str>, factor, relative| {
            let of = of.map(str::to_owned);
            Role::Deviation(Deviation { of, certain: false, factor, relative })
        };
        is(
            &["uncertainty", "std", "u", "Std. Dev", "stdev", "standard deviation", "error", "σ"],
            &deviation(None, 1.0, false),
        );
        is(&["u_r", "r_std", "std r", "u(r)", "r uncertainty"], &deviation(Some("r"), 1.0, false));
        is(&["uncertainty [%]"], &deviation(None, 0.01, true));
        is(&["rel_uncertainty"], &deviation(None, 1.0, true));
        is(&["expanded uncertainty (k=2)"], &deviation(None, 0.5, false));
        let certain =
            Deviation { of: Some("my channel".to_owned()), certain: true, factor: 1.0, relative: false };
        is(&["sigma_my channel"], &Role::Deviation(certain));
    }

    #[test]
    fn other_columns_are_not_values() {
        for name in [
            "no",
            "Index",
            "time [s]",
            "Temperature (C)",
            "temp_c",
            "timestamp",
            "theta_h",
            "phi_d",
            "Shifted Relative Azimuth",
        ] {
            assert!(matches!(role(name), Role::Other(_)), "{name}: {:?}", role(name));
        }
        is(&["lambda", "wavelength", "λ", "wl"], &Role::Wavelength(None));
        is(&["wavelength_nm", "lambda [nm]"], &Role::Wavelength(Some(1.0)));
        is(&["wavelength (um)", "λ [µm]", "wavelength_um"], &Role::Wavelength(Some(1e3)));
    }

    #[test]
    fn values_keep_their_names() {
        let value = |name: &str, doubt| Role::Value { channel: Channel::named(name), doubt };
        for name in ["f", "r", "g", "b", "brdf", "450", "550nm", "X", "my channel", "s", "p", "f_r11", "U235"]
        {
            assert_eq!(role(name), value(name, None), "{name}");
        }
        assert_eq!(role("f [1/sr]"), value("f", None));
        assert_eq!(role("brdf (sr^-1)"), value("brdf", None));
        for name in ["f_450nm", "450 [nm]", "brdf 450 nm", "0.45um"] {
            assert_eq!(role(name), value("450", None), "{name}");
        }
        assert_eq!(role("f [%]"), value("f", Some("per cent")));
        assert_eq!(role("Panel BRF"), value("Panel BRF", Some("a reflectance factor")));
        assert_eq!(role("brdf_cos"), value("brdf_cos", Some("f times a cosine")));
    }
}
