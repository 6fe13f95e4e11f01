//! Files to fit: given ones, or such as are made here.

use brdfit::geometry::{Azimuths, Directions, HalfDifferenceGrid};
use brdfit::measurement::Measurement;
use brdfit::measurement::formats::{ReadOptions, csv, merl, read};
use brdfit::model::Expression;
use brdfit::parameters::ParameterTable;
use brdfit::synthetic::{Noise, measurement, scattered_directions};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The model that most figures are for.
pub const ONE_LOBE: &str = "lambert + cook-torrance(d=ggx)";

/// Noise like that of a good instrument.
pub const NOISE: Noise = Noise { relative: 0.05, absolute: 1e-3 };

/// Measurements by what they are like.
pub struct Inputs {
    /// Full tables on the half/difference grid, at least one.
    pub tables: Vec<PathBuf>,
    /// Measurements of many wavelengths in few directions, at least one.
    pub spectral: Vec<PathBuf>,
}

impl Inputs {
    /// Sorts `files`, and makes what is missing in `folder`.
    pub fn new(files: &[PathBuf], folder: &Path) -> Self {
        let (mut tables, mut spectral): (Vec<_>, Vec<_>) =
            files.iter().cloned().partition(|file| load(file).directions.is_grid());
        if tables.is_empty() {
            tables.push(satin_table(folder));
        }
        if spectral.is_empty() {
            spectral.push(wavelengths(folder));
        }
        Self { tables, spectral }
    }

    /// The table that is looked at where one is enough.
    pub fn table(&self) -> &Path {
        &self.tables[0]
    }
}

/// Reads a measurement that must be readable.
pub fn load(file: &Path) -> Measurement {
    read(file, None, &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// A file's name for a table.
pub fn name(file: &Path) -> String {
    file.file_name().unwrap().to_string_lossy().into_owned()
}

/// Parameters for `channels` channels with lobes of different roughness.
pub fn parameters(expression: &Expression, channels: usize, azimuths: Azimuths) -> ParameterTable {
    let names: Vec<String> = (0..channels).map(|channel| format!("c{channel}")).collect();
    let mut table = ParameterTable::new(expression, &names, azimuths, &Vec::new()).unwrap();
    for index in 0..table.rows().len() {
        let row = &table.rows()[index];
        let (lobe, channel) =
            (i32::try_from(row.lobe).unwrap(), u32::try_from(row.channel.unwrap_or(0)).unwrap());
        let value = match row.spec.name {
            // The first lobe beside the diffuse one at 0.1, the next twice as rough and more.
            "m" => 0.1 * 2.5_f64.powi(lobe - 1),
            "kd" => 0.2 + 0.2 * f64::from(channel % 5) / 5.0,
            "f0" => 0.05 + 0.05 * f64::from(channel % 3),
            _ => continue,
        };
        table.set_value(index, value);
    }
    table
}

/// `n` pairs of directions up to 80 degrees.
pub fn directions(n: usize) -> Directions {
    Directions::Scattered(scattered_directions(n, 80.0, 1))
}

/// A measurement in scattered directions, without standard deviations: samples count alike.
pub fn scattered(expression: &Expression, samples: usize, channels: usize) -> Measurement {
    let table = parameters(expression, channels, Azimuths::Several);
    let mut measured = measurement(expression, &table, directions(samples), NOISE, 1);
    measured.sigma = None;
    measured
}

/// A full table of a satin material.
fn satin_table(folder: &Path) -> PathBuf {
    let expression = Expression::parse(ONE_LOBE).unwrap();
    let grid = Arc::new(HalfDifferenceGrid::merl(0.5));
    let cells: Vec<u32> = (0..u32::try_from(HalfDifferenceGrid::CELLS).unwrap())
        .filter(|cell| {
            let g = grid.geometry(*cell);
            g.cos_i() > 0.0 && g.cos_o() > 0.0
        })
        .collect();
    let directions = Directions::Grid { grid, cells: cells.clone() };
    let data = measurement(&expression, &parameters(&expression, 3, Azimuths::Lost), directions, NOISE, 1);
    let path = folder.join("satin.binary");
    let bytes = merl::encode(&path, |cell| {
        let index = cells.binary_search(&cell).ok()?;
        // Negative cells mean "not measured" in this format.
        Some([0, 1, 2].map(|channel: usize| data.values[channel][index].max(0.0)))
    });
    std::fs::write(&path, bytes.unwrap()).unwrap();
    path
}

/// As many wavelengths and directions as the measurements of paints by Cornell University have.
fn wavelengths(folder: &Path) -> PathBuf {
    const WAVELENGTHS: usize = 31;
    const SAMPLES: usize = 1439;
    let expression = Expression::parse(ONE_LOBE).unwrap();
    let data = scattered(&expression, SAMPLES, WAVELENGTHS);
    let path = folder.join("wavelengths.csv");
    std::fs::write(&path, csv::write(&data, &[]).unwrap()).unwrap();
    path
}
