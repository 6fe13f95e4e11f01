//! `brdfit synth --from-heightfield`: traces rays over a rough surface.

use crate::cli::progress::Bar;
use brdfit::Error;
use brdfit::error::OptionName;
use brdfit::measurement::formats::csv;
use brdfit::progress::Progress as _;
use brdfit::synthetic::heightfield::{BATCH, Facets, Kind, Simulation};
use clap::{Args, ValueEnum};
use std::path::Path;

/// Options of a height field.
#[derive(Args)]
pub struct HeightfieldArguments {
    /// Light the height field from these incidence angles, degrees [default: 0,15,30,45,60,75]
    #[arg(long, value_name = "DEG,...", value_delimiter = ',')]
    theta_i: Option<Vec<f64>>,
    /// Trace this number of rays per incidence angle, rounded up to full batches of 6400 [default: 400000]
    #[arg(long, value_name = "N")]
    rays: Option<usize>,
    /// Set the side of the gaussian tile, in correlation lengths [default: 32]
    #[arg(long, value_name = "N")]
    tile: Option<usize>,
    /// Draw the slopes of the v-groove's facets from this distribution [default: beckmann]
    #[arg(long, value_enum, value_name = "NAME")]
    facets: Option<Slopes>,
}

/// The surfaces that can be traced.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Surface {
    /// Random, with normally distributed heights and slopes
    Gaussian,
    /// Long symmetric grooves with their upper edges in one plane
    VGroove,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Slopes {
    Beckmann,
    Ggx,
}

impl HeightfieldArguments {
    /// Fails if one of these options is given without a height field. (The parser's own `requires` does not report this
    /// when another given option conflicts with the required one.)
    pub fn check_absent(&self) -> Result<(), Error> {
        let given = [
            ("--theta-i", self.theta_i.is_some()),
            ("--rays", self.rays.is_some()),
            ("--tile", self.tile.is_some()),
            ("--facets", self.facets.is_some()),
        ];
        given
            .iter()
            .find(|(_, given)| *given)
            .map_or(Ok(()), |(option, _)| Err(Error::invalid(*option, "--from-heightfield as well", "none")))
    }

    /// The simulation that these options and the values of `--set` describe.
    pub fn simulation(
        &self,
        surface: Surface,
        set: &[String],
        max_theta_deg: f64,
        seed: u64,
    ) -> Result<Simulation, Error> {
        let misplaced = |option: &str, surface: &str| {
            Err(Error::invalid(option, format!("--from-heightfield {surface} as well"), "another surface"))
        };
        let kind = match surface {
            Surface::Gaussian if self.facets.is_some() => return misplaced("--facets", "v-groove"),
            Surface::VGroove if self.tile.is_some() => return misplaced("--tile", "gaussian"),
            Surface::Gaussian => Kind::Gaussian { tile: self.tile.unwrap_or(32) },
            Surface::VGroove => Kind::VGroove(match self.facets {
                None | Some(Slopes::Beckmann) => Facets::Beckmann,
                Some(Slopes::Ggx) => Facets::Ggx,
            }),
        };
        let theta_i_deg = self.theta_i.clone().unwrap_or_else(|| vec![0.0, 15.0, 30.0, 45.0, 60.0, 75.0]);
        let rays = self.rays.unwrap_or(400_000);
        let simulation = Simulation { kind, m: roughness(set)?, theta_i_deg, rays, max_theta_deg, seed };
        simulation.check()?;
        Ok(simulation)
    }
}

/// The value of `--set m=V`, the only parameter of a height field; it must be given.
fn roughness(set: &[String]) -> Result<f64, Error> {
    let wrong =
        |found: &str| Error::invalid(OptionName::Set, "only m=V, the rms slope of a height field", found);
    match set {
        [] => Err(wrong("nothing")),
        [one] => {
            let number = one.strip_prefix("m=").and_then(|value| value.trim().parse().ok());
            number.ok_or_else(|| wrong(&format!("'{one}'")))
        }
        several => Err(wrong(&format!("'{}'", several.join(" ")))),
    }
}

/// Traces the rays and returns the measurement as CSV.
pub fn traced_table(simulation: &Simulation, output: &Path) -> Result<Vec<u8>, Error> {
    let bar = Bar::new(1, false);
    bar.begin(output);
    bar.stage("tracing rays");
    let traced = simulation.run(&|done, of| bar.stage(&format!("tracing rays, part {done} of {of}")));
    bar.finish();
    let traced = traced?;

    let surface = match simulation.kind {
        Kind::Gaussian { tile } => format!("gaussian, tiles of {tile} correlation lengths"),
        Kind::VGroove(Facets::Beckmann) => "v-groove, facets beckmann".to_owned(),
        Kind::VGroove(Facets::Ggx) => "v-groove, facets ggx".to_owned(),
    };
    let rays = simulation.rays.div_ceil(BATCH) * BATCH;
    let (m, seed) = (simulation.m, simulation.seed);
    let mut comments = vec![
        format!("brdfit synth --from-heightfield {surface}"),
        format!("set m={m}"),
        format!("{rays} rays for each theta_i, seed {seed}"),
    ];
    comments.extend(traced.balance.iter().zip(&simulation.theta_i_deg).map(|(balance, theta_i)| {
        format!(
            "theta_i {theta_i}: {} rays escaped, {} met the surface again",
            balance.escaped, balance.shadowed
        )
    }));
    comments.push("angles in degrees, values in 1/sr, sigma from the number of rays".to_owned());
    Ok(csv::write(&traced.measurement, &comments)?.into_bytes())
}
