//! The table of metals and lacquers in the thermal infrared, 2 to 5.7 micrometres
//! (<https://github.com/MT-MRT/JSSS-GonioreflectometryBRDF>), and others of its layout.
//!
//! `#` comments, then CSV: `material, theta_i_deg, theta_o_deg, brdf_per_sr` and columns that are not needed. All samples lie
//! in the plane of incidence on the side of the mirror direction. The published BRDF is L_o cos(theta_o)/(L_i cos(theta_i)
//! Omega_i), L radiances and Omega_i the source's solid angle; a BRDF is a radiance over an irradiance, without the viewer's
//! cosine, which is divided out. Rows from 88 degrees of incidence on are left out, as by the authors.

use super::fields::{finite, polar_angle};
use super::file::File;
use super::format::{Confidence, Format, ReadOptions};
use super::named_columns::{first_comment, for_each_row, has};
use crate::error::{Error, NameKind, Place, excerpt};
use crate::geometry::{Directions, Pair, direction};
use crate::measurement::{Channel, Instrument, Measurement, Remark};
use std::collections::{BTreeMap, HashSet};
use std::f64::consts::PI;

/// The format's entry in the registry.
pub const FORMAT: Format = Format {
    name: "mwir",
    summary: "CSV with a header material,theta_i_deg,theta_o_deg,brdf_per_sr...",
    sniff,
    read,
    directions: None,
    several_materials: true,
    extensions: &[],
    write: None,
};

/// The columns that are read.
const COLUMNS: [&str; 4] = ["material", "theta_i_deg", "theta_o_deg", "brdf_per_sr"];
/// The authors' plots leave out incidence from this angle on, degrees.
const GRAZING: f64 = 88.0;

fn sniff(file: &File<'_>) -> Confidence {
    if has(file, &COLUMNS, 2) { Confidence::Yes } else { Confidence::No }
}

fn read(file: &mut File<'_>, options: &ReadOptions) -> Result<Measurement, Error> {
    let text = file.text()?;
    let file = &*file;
    let mut all: Vec<String> = Vec::new();
    let mut seen: HashSet<String> = HashSet::new();
    let mut pairs = Vec::new();
    let mut values = Vec::new();
    let mut dropped = BTreeMap::new();
    for_each_row(file, &text, &COLUMNS, |place, [name, theta_i, theta_o, f]| {
        if name.is_empty() || name.contains(char::is_control) {
            return Err(Error::malformed(file.path, place, "the name of a material", excerpt(name)));
        }
        if seen.insert(name.to_owned()) {
            all.push(name.to_owned());
        }
        // Rows of other materials are checked, too: a damaged file is not read in part.
        let theta_i = finite(file, place, "theta_i_deg", theta_i)?;
        let theta_o = finite(file, place, "theta_o_deg", theta_o)?;
        let published = finite(file, place, "brdf_per_sr", f)?;
        polar_angle(file, place, "theta_i_deg", theta_i.to_radians())?;
        polar_angle(file, place, "theta_o_deg", theta_o.to_radians())?;
        let wanted = options.material.as_deref().or(all.first().map(String::as_str));
        if wanted != Some(name) {
            return Ok(());
        }
        let reason = if theta_i.abs() >= GRAZING {
            "grazing-incidence"
        } else if theta_o.abs() >= 90.0 {
            "below-horizon"
        } else {
            let (theta_i, theta_o) = (theta_i.to_radians(), theta_o.to_radians());
            let value = published / theta_o.cos();
            if !value.is_finite() {
                let expected = "a value that remains finite without its cosine";
                return Err(Error::malformed(file.path, place, expected, excerpt(f)));
            }
            pairs.push(Pair { wi: direction(theta_i, 0.0), wo: direction(theta_o, PI) });
            values.push(value);
            return Ok(());
        };
        *dropped.entry(reason).or_default() += 1;
        Ok(())
    })?;
    let Some(first) = all.first() else {
        return Err(Error::malformed(file.path, Place::File, "at least one row of data", "none"));
    };
    let read = options.material.as_ref().unwrap_or(first).clone();
    if !seen.contains(&read) {
        return Err(Error::unknown("--material", NameKind::Material, &all, read));
    }
    let mut remarks = vec![Remark::CosineDividedOut { angle: "theta_o" }];
    if all.len() > 1 {
        remarks.push(Remark::OneMaterial { read, all });
    }
    Ok(Measurement {
        dropped,
        remarks,
        instrument: Instrument { description: first_comment(&text), ..Instrument::default() },
        ..Measurement::of(vec![Channel::named("y")], Directions::Scattered(pairs), vec![values])
    })
}
