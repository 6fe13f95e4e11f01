//! Fits a model to a measurement in a file, and prints every parameter with its standard error.
//!
//! ```sh
//! cargo run --release --example fit_csv -- data/satin-red-paint.csv "lambert + cook-torrance"
//! ```
#![allow(clippy::print_stdout)]

use brdfit::{Expression, Fit, HoldOut, Measurement, Report, report};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let (Some(file), Some(model)) = (arguments.next(), arguments.next()) else {
        return Err("usage: fit_csv FILE MODEL".into());
    };
    let measurement = Measurement::read(file)?;
    let model: Expression = model.parse()?;

    // A fifth of the angles of incidence is not fitted, and says how well the model predicts.
    let (fit, report): (Fit, Report) =
        Fit::of(&model, &measurement).hold_out(HoldOut::fraction(0.2)?).run_with_report()?;
    for parameter in fit.parameters() {
        println!("{parameter}");
    }
    println!("error on what was fitted: {:.4e}", fit.errors.all.cbrt);
    if let Some(held_out) = &fit.held_out {
        println!("error on what a fit had not seen: {:.4e}", held_out.errors.cbrt);
    }

    // The table of the command line, warnings included.
    println!("\n{}", report::table(&report));
    if fit.is_usable() { Ok(()) } else { Err("the fit is not usable".into()) }
}
