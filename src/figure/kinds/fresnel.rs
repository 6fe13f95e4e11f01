//! Fresnel reflectance over the difference angle, as fitted.

use crate::error::Error;
use crate::figure::data::{Axes, Axis, Body, Colour, Curves, Dash, FigureData, Look, Panel, Series};
use crate::figure::kind::{
    Kind, Needs, Several, Subject, Wanted, channel_title, channels_shown, chosen_channels, names,
};
use crate::figure::text::Text;
use crate::model::parts::fresnel::Fresnel;
use crate::model::{Lobe, Role};
use crate::parameters::ParameterTable;
use crate::report::Spread;

/// The entry of the registry.
pub const KIND: Kind = Kind {
    name: "fresnel",
    summary: "Fresnel reflectance over the difference angle, with its uncertainty",
    needs: Needs::Report,
    several: Several::Overlaid,
    raster: false,
    compute,
};

/// Half degrees from 0 to 90.
const ANGLES: std::ops::RangeInclusive<i32> = 0..=180;

/// A Fresnel term of a model, and where its parameters are.
struct Term {
    name: String,
    /// Its name among the options of a model.
    choice: &'static str,
    fresnel: Fresnel,
    lobe: usize,
    /// The places of its parameters among those of the lobe, by role.
    shapes: Vec<usize>,
    amplitudes: Vec<usize>,
}

fn compute(subjects: &[Subject], wanted: &Wanted) -> Result<FigureData, Error> {
    let called = names(subjects);
    let mut series = Vec::new();
    let (mut colour, mut missing) = (0, Vec::new());
    let mut shown = String::new();
    for (index, (subject, name)) in subjects.iter().zip(&called).enumerate() {
        let recorded = subject.fitted()?;
        let channels = subject.channels();
        let chosen = chosen_channels(&channels, wanted)?;
        shown = channels_shown(&channels, &chosen);
        let terms: Vec<Term> =
            recorded.expression.lobes().iter().enumerate().filter_map(|(k, lobe)| term(k, lobe)).collect();
        if terms.is_empty() {
            missing.push(recorded.expression.canonical());
        }
        let spread = Spread::of(recorded);
        let several_lobes = terms.len() > 1;
        for term in &terms {
            for &channel in &chosen {
                let evaluate = |table: &ParameterTable| reflectance(term, table, channel);
                let f = evaluate(&recorded.table);
                let band = spread.as_ref().map(|spread| {
                    let within = |[low, high]: [f64; 2]| [low.max(0.0), high.min(1.0)];
                    spread.band(&f, evaluate).into_iter().map(within).collect()
                });
                let mut parts = Vec::new();
                parts.extend((subjects.len() > 1).then(|| name.clone()));
                parts.extend(several_lobes.then(|| term.name.clone()));
                parts.extend(
                    (chosen.len() > 1).then(|| channels.get(channel).map(channel_title).unwrap_or_default()),
                );
                if parts.is_empty() {
                    parts.push(format!("F ({})", term.choice));
                }
                let dash = if subjects.len() > 1 { index } else { colour };
                let look = Look { colour: Colour::Of(colour), line: Some(Dash::Of(dash)), marker: None };
                let points = angles().zip(f).map(|(angle, f)| [angle, f]).collect();
                series.push(Series { name: parts.join(", ").into(), look, points, band, in_legend: true });
                colour += 1;
            }
        }
    }
    if series.is_empty() {
        let expected = "a model with a Fresnel term to choose, such as cook-torrance(f=schlick)";
        return Err(Error::invalid(KIND.name, expected, missing.join("; ")));
    }
    let x = Axis::angle("theta_d").from_to(0.0, 90.0);
    let y = Axis::new(Text::of_symbol("F"), "").from_to(0.0, 1.0);
    let curves = Curves { axes: Axes::Cartesian, x, y, series, marks: Vec::new() };
    let by = match called.as_slice() {
        [only] => format!(" by {only}"),
        _ => String::new(),
    };
    let mut caption = Text::from("Fresnel reflectance ")
        .symbol("F")
        .words(" over the difference angle ")
        .symbol("theta_d")
        .words(format!(", as fitted{by}, with its 95 % band where the report has a covariance."));
    if !missing.is_empty() {
        caption = caption.words(format!(" Without such a term: {}.", missing.join("; ")));
    }
    let panels = vec![Panel { title: Text::default(), body: Body::Curves(curves) }];
    Ok(FigureData { kind: KIND.name, panels, caption: caption.words(shown), side_by_side: [1, 1] })
}

fn angles() -> impl Iterator<Item = f64> {
    ANGLES.map(|k| 0.5 * f64::from(k))
}

/// The Fresnel term of a lobe; `None` if the lobe has none to choose, or chose none.
fn term(index: usize, lobe: &Lobe) -> Option<Term> {
    let choice = lobe.choice("f");
    if choice == "none" || !Fresnel::names().contains(&choice) {
        return None;
    }
    let fresnel = Fresnel::named(choice);
    let specs = lobe.parameters();
    let of_role = |role: Role| -> Vec<usize> {
        let own = fresnel.parameters().into_iter().filter(|spec| spec.role == role);
        own.filter_map(|own| specs.iter().position(|spec| spec.name == own.name)).collect()
    };
    Some(Term {
        name: lobe.name.clone(),
        choice,
        fresnel,
        lobe: index,
        shapes: of_role(Role::Shape),
        amplitudes: of_role(Role::Amplitude),
    })
}

/// F over the angles in a channel of the table.
fn reflectance(term: &Term, table: &ParameterTable, channel: usize) -> Vec<f64> {
    let values = |places: &[usize]| -> Vec<f64> {
        let row = |parameter: &usize| table.rows().get(table.place(term.lobe, *parameter, channel));
        places.iter().filter_map(row).map(|row| row.value * row.spec.unit.factor(row.channel)).collect()
    };
    let (shapes, amplitudes) = (values(&term.shapes), values(&term.amplitudes));
    angles()
        .map(|angle| {
            // At 90 degrees the exact formulas need a cosine above 0.
            let mu = angle.to_radians().cos().max(1e-12);
            term.fresnel.reflectance(&shapes, &amplitudes, mu)
        })
        .collect()
}
