//! Writes named arrays of NumPy.

use super::npy::{floats, strings};
use crate::error::Error;
use crate::geometry::{Directions, Pair, direction, spherical_degrees};
use crate::measurement::formats::csv::ANGLES;
use crate::measurement::formats::writing::{AngleGrid, Covered, Subject, Written};
use std::io::{Cursor, Write as _};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

/// The largest number of directions of a grid.
const MOST_DIRECTIONS: usize = 20_000_000;

/// Angles in degrees, one list for each of theta_i, phi_i, theta_o and phi_o.
type Angles = [Vec<f64>; 4];

/// Writes a measurement as it is, with NaN where nothing was measured, or a model or a chosen grid by its values there.
pub(super) fn write(subject: &Subject<'_>) -> Result<Written, Error> {
    let mut losses = Vec::new();
    let (angles, values, sigma) = match (subject.measurement, subject.grid) {
        (Some(measurement), None) => {
            if measurement.instrument.receiver_sr.is_some()
                || !measurement.instrument.total_scatter.is_empty()
            {
                losses.push(
                    "what the file says about the instrument, beside its description, is not written"
                        .to_owned(),
                );
            }
            (angles_of(&measurement.directions), measurement.values.clone(), measurement.sigma.clone())
        }
        (_, grid) => {
            let angles = on_grid(grid.unwrap_or(&AngleGrid::default()), subject.isotropic)?;
            let pairs = pairs(&angles);
            let values = (subject.at)(&pairs);
            let mut covered = Covered::default();
            covered.count(subject, &pairs);
            losses.extend(covered.loss());
            let missing = values.iter().flatten().filter(|f| !f.is_finite()).count();
            if missing > 0 {
                losses.push(format!(
                    "{missing} values are not finite and are written as NaN, which means not measured"
                ));
            }
            let finite = |f: f64| if f.is_finite() { f } else { f64::NAN };
            let values = values.into_iter().map(|row| row.into_iter().map(finite).collect()).collect();
            (angles, values, None)
        }
    };
    let [theta_i, ..] = &angles;
    let samples = theta_i.len();
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    let mut put = |name: &str, bytes: &[u8]| -> Result<(), zip::result::ZipError> {
        let options = SimpleFileOptions::default()
            // As `numpy.savez` does: measured digits hardly shrink, and unpacking them takes longer than reading them.
            .compression_method(CompressionMethod::Stored)
            .large_file(u32::try_from(bytes.len()).is_err());
        archive.start_file(format!("{name}.npy"), options)?;
        archive.write_all(bytes)?;
        Ok(())
    };
    let by_sample = |rows: &[Vec<f64>]| {
        let cell = |index: usize, row: &Vec<f64>| row.get(index).copied().unwrap_or(f64::NAN);
        let all =
            (0..samples).flat_map(|index| rows.iter().map(move |row| cell(index, row)).collect::<Vec<_>>());
        floats(&[samples, rows.len()], all)
    };
    let mut all = || -> Result<(), zip::result::ZipError> {
        for (name, list) in ANGLES.iter().zip(&angles) {
            put(name, &floats(&[samples], list.iter().copied()))?;
        }
        put("values", &by_sample(&values))?;
        if let Some(sigma) = &sigma {
            put("sigma", &by_sample(sigma))?;
        }
        let names: Vec<&str> = subject.channels.iter().map(|channel| channel.name.as_str()).collect();
        put("channels", &strings(&names))?;
        let wavelengths: Vec<Option<f64>> =
            subject.channels.iter().map(|channel| channel.wavelength_nm).collect();
        if wavelengths.iter().any(Option::is_some) {
            let wavelengths = wavelengths.iter().map(|nm| nm.unwrap_or(f64::NAN));
            put("wavelengths_nm", &floats(&[subject.channels.len()], wavelengths))?;
        }
        put("description", &strings(&[subject.about]))
    };
    let failed = |error: zip::result::ZipError| Error::Encoding { format: "npz", reason: error.to_string() };
    all().map_err(failed)?;
    let bytes = archive.finish().map_err(failed)?.into_inner();
    Ok(Written { bytes, losses })
}

/// The angles of a measurement's samples.
fn angles_of(directions: &Directions) -> Angles {
    let mut angles: Angles = Default::default();
    for g in directions.iter() {
        let ((theta_i, phi_i), (theta_o, phi_o)) =
            (spherical_degrees(g.wi.into()), spherical_degrees(g.wo.into()));
        for (list, angle) in angles.iter_mut().zip([theta_i, phi_i, theta_o, phi_o]) {
            list.push(angle);
        }
    }
    angles
}

/// Every combination of a grid's angles.
fn on_grid(grid: &AngleGrid, isotropic: bool) -> Result<Angles, Error> {
    let or = |list: &Vec<f64>, step: u32, last: u32| -> Vec<f64> {
        if list.is_empty() { (0..=last / step).map(|k| f64::from(step * k)).collect() } else { list.clone() }
    };
    let theta_i = or(&grid.theta_i_deg, 5, 85);
    let phi_i = if isotropic && grid.phi_i_deg.is_empty() { vec![0.0] } else { or(&grid.phi_i_deg, 30, 330) };
    let theta_o = or(&grid.theta_o_deg, 5, 85);
    let phi = or(&grid.phi_deg, 15, if isotropic { 180 } else { 345 });
    let number =
        [&theta_i, &phi_i, &theta_o, &phi].iter().fold(1, |n: usize, list| n.saturating_mul(list.len()));
    if number > MOST_DIRECTIONS {
        let expected = format!("at most {MOST_DIRECTIONS} directions");
        return Err(Error::invalid("--grid", expected, number.to_string()));
    }
    let mut angles: Angles = Default::default();
    for i in &theta_i {
        for phi_i in &phi_i {
            for o in &theta_o {
                for phi in &phi {
                    for (list, angle) in angles.iter_mut().zip([*i, *phi_i, *o, phi_i + phi]) {
                        list.push(angle);
                    }
                }
            }
        }
    }
    Ok(angles)
}

fn pairs([theta_i, phi_i, theta_o, phi_o]: &Angles) -> Vec<Pair> {
    let of = |theta: &f64, phi: &f64| direction(theta.to_radians(), phi.to_radians());
    let lights = theta_i.iter().zip(phi_i).map(|(theta, phi)| of(theta, phi));
    let viewers = theta_o.iter().zip(phi_o).map(|(theta, phi)| of(theta, phi));
    lights.zip(viewers).map(|(wi, wo)| Pair { wi, wo }).collect()
}
