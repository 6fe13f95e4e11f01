//! The table of metals and lacquers in the thermal infrared, 2 to 5.7 micrometres
//! (<https://github.com/MT-MRT/JSSS-GonioreflectometryBRDF>), and others of its layout.
//!
//! `#` comments, then CSV: `material, theta_i_deg, theta_o_deg, brdf_per_sr` and columns that are not needed. All samples lie
//! in the plane of incidence on the side of the mirror direction. The published BRDF is L_o cos(theta_o)/(L_i cos(theta_i)
//! Omega_i), L radiances and Omega_i the source's solid angle; a BRDF is a radiance over an irradiance, without the viewer's
//! cosine, which is divided out. Rows from 88 degrees of incidence on are left out, as by the authors, and so are those without a value:
//! `nan` or a blank field.

use super::csv::records;
use super::fields::{finite, polar_angle, value_or_blank};
use super::file::File;
use super::format::{Confidence, Format, ReadOptions};
use super::named_columns::{first_comment, has, read_columns};
use super::rows::Rows;
use crate::error::{Error, NameKind, Place, excerpt};
use crate::geometry::{Pair, direction};
use crate::measurement::{Channel, Instrument, Measurement, Remark};
use std::collections::HashSet;
use std::f64::consts::PI;

/// The format's entry in the registry.
pub const FORMAT: Format = Format {
    name: "mwir",
    summary: "CSV with a header material,theta_i_deg,theta_o_deg,brdf_per_sr...",
    sniff,
    read,
    directions: None,
    several_materials: true,
    own_options: &[],
    knows_angles: false,
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
    file.with_text(|file, text| read_text(file, text, options))
}

fn read_text(file: &File<'_>, text: &str, options: &ReadOptions) -> Result<Measurement, Error> {
    let wanted = options.material.clone().or_else(|| first_material(text)).unwrap_or_default();
    let parts = read_columns(file, text, &COLUMNS, Part::new, |part, place, fields| {
        part.take(file, place, fields, &wanted)
    })?;
    let mut materials = Materials::default();
    let mut rows = Vec::new();
    for part in parts {
        part.materials.all.iter().for_each(|name| materials.take(name));
        rows.push(part.rows);
    }
    let Materials { all, seen } = materials;
    if all.is_empty() {
        return Err(Error::malformed(file.path, Place::File, "at least one row of data", "none"));
    }
    if !seen.contains(&wanted) {
        return Err(Error::unknown("--material", NameKind::Material, &all, wanted));
    }
    let mut remarks = vec![Remark::CosineDividedOut { angle: "theta_o" }];
    if all.len() > 1 {
        remarks.push(Remark::OneMaterial { read: wanted, all });
    }
    Ok(Measurement {
        remarks,
        instrument: Instrument { description: first_comment(text), ..Instrument::default() },
        ..Rows::joined(1, rows).measurement(vec![Channel::named("y")])
    })
}

/// The material of the first row, if there is one.
fn first_material(text: &str) -> Option<String> {
    let mut records = records(text).map_while(Result::ok);
    let ((_, header), (_, row)) = (records.next()?, records.next()?);
    let [material, ..] = COLUMNS;
    let column = header.iter().position(|field| field == material)?;
    row.get(column).map(str::to_owned)
}

/// Names of materials, in the order of the file.
#[derive(Default)]
struct Materials {
    all: Vec<String>,
    seen: HashSet<String>,
}

impl Materials {
    fn take(&mut self, name: &str) {
        if !self.seen.contains(name) {
            self.seen.insert(name.to_owned());
            self.all.push(name.to_owned());
        }
    }
}

/// A part of the text.
struct Part {
    materials: Materials,
    /// The samples of one material.
    rows: Rows,
}

impl Part {
    fn new() -> Self {
        Self { materials: Materials::default(), rows: Rows::new(1) }
    }

    fn take(
        &mut self,
        file: &File<'_>,
        place: Place,
        [name, theta_i, theta_o, f]: [&str; 4],
        wanted: &str,
    ) -> Result<(), Error> {
        if name.is_empty() || name.contains(char::is_control) {
            return Err(Error::malformed(file.path, place, "the name of a material", excerpt(name)));
        }
        self.materials.take(name);
        // Rows of other materials are checked, too: a damaged file is not read in part.
        let theta_i = finite(file, place, "theta_i_deg", theta_i)?;
        let theta_o = finite(file, place, "theta_o_deg", theta_o)?;
        let published = value_or_blank(file, place, "brdf_per_sr", f)?;
        polar_angle(file, place, "theta_i_deg", theta_i.to_radians())?;
        polar_angle(file, place, "theta_o_deg", theta_o.to_radians())?;
        if wanted != name {
            return Ok(());
        }
        if theta_i.abs() >= GRAZING {
            self.rows.drop("grazing-incidence");
            return Ok(());
        }
        if theta_o.abs() >= 90.0 {
            self.rows.drop("below-horizon");
            return Ok(());
        }
        let (theta_i, theta_o) = (theta_i.to_radians(), theta_o.to_radians());
        let value = published / theta_o.cos();
        if value.is_infinite() {
            let expected = "a value that remains finite without its cosine";
            return Err(Error::malformed(file.path, place, expected, excerpt(f)));
        }
        self.rows.pairs.push(Pair { wi: direction(theta_i, 0.0), wo: direction(theta_o, PI) });
        self.rows.values.iter_mut().for_each(|row| row.push(value));
        Ok(())
    }
}
