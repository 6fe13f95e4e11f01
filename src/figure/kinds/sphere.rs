//! Spheres: measured, fitted, and their difference, rendered as `brdfit render` does.

use crate::error::Error;
use crate::figure::data::{Body, FigureData, Panel, Picture};
use crate::figure::kind::{Kind, Needs, Subject, Wanted, only};
use crate::figure::text::Text;
use crate::image::{Route, absolute_difference};
use crate::scene::Scene;
use crate::select::{ModelAt, render};

/// The entry of the registry.
pub const KIND: Kind = Kind {
    name: "sphere",
    summary: "a ball as measured, as fitted, and the difference",
    needs: Needs::Measurement,
    raster: true,
    compute,
};

/// Sides of the image of the default scene, pixels: as many as the largest view has room for in its light.
const SIDE: u32 = 128;

fn compute(subjects: &[Subject], wanted: &Wanted) -> Result<FigureData, Error> {
    let subject = only(subjects, KIND.name)?;
    let measurement = subject.measured()?;
    let scene = wanted.scene.clone().map_or_else(|| Scene::studio(SIDE), Ok)?;
    let values = subject.recorded.as_ref().map(|_| subject.values()).transpose()?;
    let model = subject.recorded.as_ref().zip(values.as_ref());
    let model = model.map(|(recorded, values)| ModelAt { expression: &recorded.expression, values });
    // A picture leaves nothing out that a reader might look at.
    let rendered = render(measurement, &scene, model, 90.0)?;
    let exposure = rendered.exposure;
    let panel =
        |title: &str, image| Panel { title: title.into(), body: Body::Picture(Picture { image, exposure }) };
    let mut caption = Text::from(format!(
        "{} in the scene {}, {}",
        subject.stem(),
        scene.path().display(),
        colours(rendered.colour)
    ));
    let mut panels = Vec::new();
    if let (Some((fitted, differences)), Some(recorded)) = (rendered.fitted, &subject.recorded) {
        caption = caption.words(format!(
            ": as measured, as fitted by {}, and the absolute difference",
            recorded.expression.canonical()
        ));
        if let Some(rmse) = differences.relative_rmse {
            caption = caption.words(format!(". The relative RMSE of the radiance is {:.2} %", 100.0 * rmse));
        }
        let p95 = differences.delta_e_2000.p95;
        caption = caption.words(format!("; 95 % of the pixels are within {p95:.2} CIEDE2000"));
        let difference = absolute_difference(&rendered.measured, &fitted)?;
        panels.push(panel("measured", rendered.measured));
        panels.push(panel("fit", fitted));
        panels.push(panel("difference", difference));
    } else {
        panels.push(panel("measured", rendered.measured));
    }
    let side_by_side = [panels.len(); 2];
    let caption = caption.words(". All panels have the same exposure; black where nothing was measured.");
    Ok(FigureData { kind: KIND.name, panels, caption, side_by_side })
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
