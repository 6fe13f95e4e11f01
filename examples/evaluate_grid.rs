//! Evaluates a model at given parameters over a grid of directions, and prints a table that `brdfit` reads.
//!
//! ```sh
//! cargo run --release --example evaluate_grid > satin.csv
//! ```
#![allow(clippy::print_stdout)]

use brdfit::{Brdf, Directions, Error, Expression};

fn main() -> Result<(), Error> {
    // A satin red paint. Parameters without a channel are those of all channels.
    let model: Expression = "lambert + cook-torrance(d=ggx, g=smith, f=schlick)".parse()?;
    let values = [("kd.r", 0.42), ("kd.g", 0.055), ("kd.b", 0.048), ("m", 0.18), ("f0", 0.05)];
    let brdf = Brdf::new(&model, &["r", "g", "b"], &values)?;

    // The light every 20 degrees, the viewer every 5 degrees in the plane of incidence and across it.
    let polar = |count: u8, step: f64| (0..count).map(move |k| step * f64::from(k));
    let angles: Vec<[f64; 4]> = polar(5, 20.0)
        .flat_map(|theta_i| polar(17, 5.0).map(move |theta_o| (theta_i, theta_o)))
        .flat_map(|(theta_i, theta_o)| [0.0, 90.0, 180.0].map(|phi_o| [theta_i, 0.0, theta_o, phi_o]))
        .collect();
    let by_channel = brdf.values(&Directions::from_degrees(angles.iter().copied())?);

    println!("theta_i,phi_i,theta_o,phi_o,{}", brdf.channels().join(","));
    for (sample, angles) in angles.iter().enumerate() {
        let values = by_channel.iter().filter_map(|values| values.get(sample));
        let fields: Vec<String> = angles.iter().chain(values).map(f64::to_string).collect();
        println!("{}", fields.join(","));
    }
    Ok(())
}
