//! Spheres: measured, fitted by each model, and their difference, rendered as `brdfit render` does.

use crate::error::Error;
use crate::figure::data::{Body, FigureData, Panel, Picture};
use crate::figure::kind::{Kind, Needs, Several, Subject, Wanted, fits, of_one_measurement, which};
use crate::image::{Route, absolute_difference};
use crate::scene::Scene;
use crate::select::{ModelAt, render};

/// The entry of the registry.
pub const KIND: Kind = Kind {
    name: "sphere",
    summary: "a ball as measured, as fitted, and the difference; of several models a row each",
    needs: Needs::Measurement,
    several: Several::Rows,
    raster: true,
    compute,
};

/// Sides of the image of the default scene, pixels: as many as the largest view has room for in its light.
const SIDE: u32 = 128;

fn compute(subjects: &[Subject], wanted: &Wanted) -> Result<FigureData, Error> {
    let subject = of_one_measurement(subjects, KIND.name)?;
    let scene = wanted.scene.clone().map_or_else(|| Scene::studio(SIDE), Ok)?;
    let fits = fits(subjects)?;
    let models: Vec<ModelAt<'_>> =
        fits.iter().map(|(recorded, values)| ModelAt { expression: &recorded.expression, values }).collect();
    // A picture leaves nothing out that a reader might look at.
    let rendered = render(subject.measured()?, &scene, &models, 90.0)?;
    let (measured, exposure) = (rendered.measured, rendered.exposure);
    let panel = |title: String, image| Panel {
        title: title.into(),
        body: Body::Picture(Picture { image, exposure }),
    };
    let mut caption =
        format!("{} in the scene {}, {}", subject.stem(), scene.path().display(), colours(rendered.colour));
    let mut panels = Vec::new();
    if models.is_empty() {
        panels.push(panel("measured".to_owned(), measured));
    } else {
        caption.push_str(": as measured, as fitted, and the absolute difference.");
        for (k, ((fitted, differences), model)) in rendered.fitted.into_iter().zip(&models).enumerate() {
            let which = which(models.len(), k);
            caption.push_str(&format!(" Fit{which}: {}", model.expression.canonical()));
            if let Some(rmse) = differences.relative_rmse {
                caption.push_str(&format!(", relative RMSE of the radiance {:.2} %", 100.0 * rmse));
            }
            let p95 = differences.delta_e_2000.p95;
            caption.push_str(&format!(", 95 % of the pixels within {p95:.2} CIEDE2000."));
            let difference = absolute_difference(&measured, &fitted)?;
            panels.push(panel("measured".to_owned(), measured.clone()));
            panels.push(panel(format!("fit{which}"), fitted));
            panels.push(panel(format!("difference{which}"), difference));
        }
    }
    let side_by_side = [panels.len().min(3), panels.len().min(6)];
    caption.push_str(" All panels have the same exposure; black where nothing was measured.");
    Ok(FigureData { kind: KIND.name, panels, caption: caption.into(), side_by_side })
}

/// How the channels became colours.
fn colours(route: Route) -> &'static str {
    match route {
        Route::Rgb => "in its channels r, g and b",
        Route::Spectrum => "in the colours of its spectrum under D65",
        Route::Grey | Route::GreyInvisible => "in grey, the mean of its channels",
        Route::GreyFewWavelengths => "in grey, the mean of its visible channels",
    }
}
