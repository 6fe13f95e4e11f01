//! How far a model is from the data, beside their noise: never said of a model that is true, and said of one that is not.

use brdfit::fit::{Fit, Misfit, NoiseSource, Options, SigmaScale, Uncertainty, Warning, WarningKind, fit};
use brdfit::geometry::{Azimuths, Directions, Pair};
use brdfit::measurement::{Filters, Measurement, Weighting};
use brdfit::model::Expression;
use brdfit::parameters::{ParameterTable, Setting, values};
use brdfit::progress::{Progress, Quiet};
use brdfit::synthetic::{Noise, measurement, scattered_directions};
use rayon::prelude::*;
use std::sync::Arc;

/// Ten models, each with parameters of a material.
const TRUE: [(&str, &[&str]); 10] = [
    ("lambert", &["kd=0.4"]),
    ("oren-nayar", &["albedo=0.5", "sigma=20"]),
    ("eon", &[]),
    ("cook-torrance", &["m=0.2", "f0=0.8"]),
    ("lambert + cook-torrance", &["kd=0.2", "m=0.3", "f0=0.05"]),
    ("lambert + ward", &["kd=0.2", "m=0.15", "ks=0.2"]),
    ("lambert + phong", &["kd=0.3", "ks=0.2", "n=40"]),
    ("lambert + blinn-phong", &["kd=0.2", "ks=0.3", "n=60"]),
    ("ashikhmin-shirley", &["rd=0.3", "rs=0.1", "nu=80", "nv=80"]),
    ("disney-2012", &["base=0.4", "roughness=0.4", "metallic=0.1"]),
];

fn made(model: &str, set: &[&str], pairs: Vec<Pair>, noise: Noise, seed: u64) -> Measurement {
    let expression = Expression::parse(model).unwrap();
    let set: Vec<String> = set.iter().map(|text| (*text).to_owned()).collect();
    let set = values(brdfit::error::OptionName::Set, &set, Setting::Set).unwrap();
    let table = ParameterTable::new(&expression, &["y".to_owned()], Azimuths::Several, &set).unwrap();
    measurement(&expression, &table, Directions::Scattered(pairs), noise, seed)
}

fn without_sigma(mut data: Measurement) -> Measurement {
    data.sigma = None;
    data
}

fn fitted(data: &Measurement, model: &str, options: &Options) -> Fit {
    let quiet = Arc::new(Quiet) as Arc<dyn Progress>;
    fit(data, &Expression::parse(model).unwrap(), options, &quiet).unwrap()
}

fn warns(fit: &Fit, kind: WarningKind) -> bool {
    fit.warnings.iter().any(|warning| warning.kind() == kind)
}

fn misfit(fit: &Fit) -> Misfit {
    fit.misfit.expect("enough samples")
}

const TWO_PERCENT: Noise = Noise { relative: 0.02, absolute: 0.0 };

/// 200 files of ten models, with and without noise, and with few samples and more. Without sigma, neighbours decide.
#[test]
fn true_models_are_never_called_misfits() {
    let noises = [
        Noise { relative: 0.0, absolute: 0.0 },
        TWO_PERCENT,
        Noise { relative: 0.2, absolute: 0.0 },
        Noise { relative: 0.02, absolute: 0.005 },
    ];
    let mut cases = Vec::new();
    for (model, set) in TRUE {
        for (index, noise) in noises.into_iter().enumerate() {
            for (round, samples) in [60, 120, 250, 500, 1000].into_iter().enumerate() {
                cases.push((model, set, noise, samples, u64::try_from(5 * index + round).unwrap()));
            }
        }
    }
    assert_eq!(cases.len(), 200);
    let wrong: Vec<String> = cases
        .par_iter()
        .filter_map(|(model, set, noise, samples, seed)| {
            let pairs = scattered_directions(*samples, 80.0, *seed);
            let data = without_sigma(made(model, set, pairs, *noise, *seed));
            let fit = fitted(&data, model, &Options::default());
            warns(&fit, WarningKind::Misfit).then(|| format!("{model}, {samples}: {:?}", fit.misfit))
        })
        .collect();
    assert!(wrong.is_empty(), "{} of 200:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn wrong_models_are_called_misfits() {
    let glossy = |noise| {
        let pairs = scattered_directions(1000, 80.0, 3);
        made("lambert + cook-torrance", &["kd=0.2", "m=0.2", "f0=0.05"], pairs, noise, 4)
    };
    let exact = Noise { relative: 0.0, absolute: 0.0 };
    for noise in [exact, TWO_PERCENT] {
        let data = without_sigma(glossy(noise));
        for model in ["lambert", "oren-nayar", "lambert + ward", "lambert + phong", "lambert + retro"] {
            let fit = fitted(&data, model, &Options::default());
            assert!(warns(&fit, WarningKind::Misfit), "{model}: {:?}", fit.misfit);
            // It changes nothing about whether the fit is usable.
            assert!(fit.is_usable(), "{model}");
        }
    }
    // Where, too: the peak of a lobe that the model does not have.
    let worst = misfit(&fitted(&glossy(TWO_PERCENT), "lambert", &Options::default())).worst.unwrap();
    assert!(worst.near_mirror && worst.theta_i_deg[0] >= 50.0, "{worst}");
}

/// The standard deviations of the file come first, then repeats, then exchanged pairs or neighbours.
#[test]
fn noise_is_taken_from_the_best_source() {
    let pairs = scattered_directions(300, 75.0, 5);
    let material = |pairs: Vec<Pair>, noise| {
        made("lambert + cook-torrance", &["kd=0.2", "m=0.3", "f0=0.05"], pairs, noise, 6)
    };
    let model = "lambert + cook-torrance";
    let source = |data: &Measurement| {
        let fit = fitted(data, model, &Options::default());
        let found = misfit(&fit);
        assert!((0.7..1.3).contains(&found.ratio.unwrap()), "{found:?}");
        (found.source.unwrap(), fit.sigma_unused)
    };
    let given = material(pairs.clone(), TWO_PERCENT);
    assert_eq!(source(&given), (NoiseSource::Sigma, true));
    assert_eq!(source(&without_sigma(given)), (NoiseSource::Neighbours, false));
    let twice = [pairs.clone(), pairs.clone()].concat();
    assert_eq!(source(&without_sigma(material(twice, TWO_PERCENT))).0, NoiseSource::Repeats);

    // Where a wrong model misses differently at every one of few samples, only exchanged pairs show how small the noise is.
    let few = scattered_directions(120, 75.0, 5);
    let back = few.iter().map(|pair| Pair { wi: pair.wo, wo: pair.wi });
    let both = few.iter().copied().chain(back).collect();
    let data = without_sigma(material(both, Noise { relative: 0.002, absolute: 0.0 }));
    let fit = fitted(&data, "lambert + ward", &Options::default());
    let found = misfit(&fit);
    assert_eq!(found.source, Some(NoiseSource::ReciprocalPairs), "{found:?}");
    assert!(found.ratio.unwrap() > 3.0 && warns(&fit, WarningKind::Misfit), "{found:?}");
}

/// Standard deviations that are three times too small, right, and three times too large.
#[test]
fn chi_square_tells_wrong_standard_deviations() {
    let pairs = scattered_directions(500, 80.0, 7);
    let right = made("lambert + cook-torrance", &["kd=0.2", "m=0.3", "f0=0.05"], pairs, TWO_PERCENT, 8);
    let scaled = |factor: f64| {
        let mut data = right.clone();
        data.sigma.iter_mut().flatten().flatten().for_each(|sigma| *sigma *= factor);
        data
    };
    let filters = Filters::default().with_weighting(Weighting::Sigma);
    let by_default = Options::default().with_filters(filters);
    let options = by_default.clone().with_uncertainty(Uncertainty::Formula);
    let automatic = options.clone().with_sigma_scale(SigmaScale::Auto);
    let model = "lambert + cook-torrance";
    let error = |fit: &Fit| fit.parameter("m").unwrap().std_error.unwrap();
    let honest = error(&fitted(&right, model, &options));
    for (factor, expected, words) in
        [(1.0 / 3.0, true, "larger than the given"), (1.0, false, ""), (3.0, true, "smaller than the given")]
    {
        let fit = fitted(&scaled(factor), model, &options);
        let chi2 = fit.reduced_chi2.unwrap();
        assert!((chi2 * factor * factor - 1.0).abs() < 0.2, "{factor}: {chi2}");
        let warning = fit.warnings.iter().find(|warning| warning.kind() == WarningKind::ChiSquare);
        assert_eq!(warning.is_some(), expected, "{factor}");
        assert!(warning.is_none_or(|warning| warning.to_string().contains(words)), "{factor}: {warning:?}");
        assert!((error(&fit) / (honest * factor) - 1.0).abs() < 1e-6, "{factor}");
        // By default, they are as small as the file says only if the residuals are.
        let cautious = error(&fitted(&scaled(factor), model, &by_default)) / error(&fit);
        if factor < 1.0 {
            let [low, high] =
                fitted(&scaled(factor), model, &by_default).parameter("m").unwrap().ci95.unwrap();
            assert!(cautious > 2.0 && (low..=high).contains(&0.3), "{cautious}: {low} to {high}");
        } else {
            assert!((cautious - 1.0).abs() < 1e-9, "{cautious}");
        }
        // Scaled by chi-square, the errors are those of the residuals, whatever factor the file has.
        let rescaled = error(&fitted(&scaled(factor), model, &automatic));
        assert!((rescaled / (error(&fit) * chi2.sqrt()) - 1.0).abs() < 1e-6, "{factor}");
        assert!((rescaled / honest - 1.0).abs() < 0.1, "{factor}");
    }
}

/// The words say what to do, and a misfit by given standard deviations is one as well.
#[test]
fn a_misfit_is_said_in_words() {
    let pairs = scattered_directions(500, 80.0, 9);
    let data = made("lambert + cook-torrance", &["kd=0.2", "m=0.3", "f0=0.05"], pairs, TWO_PERCENT, 8);
    let fit = fitted(&data, "lambert", &Options::default());
    let warning = fit.warnings.iter().find(|warning| matches!(warning, Warning::Misfit(_))).unwrap();
    let text = warning.to_string();
    assert!(
        text.contains("times farther from the data than their noise (by the standard deviations"),
        "{text}"
    );
    assert!(text.contains("worst at theta_i ") && text.contains("compare other models"), "{text}");
}
