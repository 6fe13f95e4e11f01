//! NIST's table of PTFE and the table of metals in the thermal infrared. Counts and sums are those of a second implementation
//! in Python (math.fsum over the rows), which read the files before this program did.

use super::alta::sums;
use super::{CENTER, assert_direction, geometries, parse, parsed, read};
use crate::common::shared;
use approx::assert_relative_eq;
use brdfit::measurement::formats::ReadOptions;
use brdfit::measurement::{Channel, Remark};
use std::f64::consts::PI;

#[test]
fn ptfe() {
    let Some(path) = shared("nist-ptfe/PTFE.data.csv") else { return };
    let m = read(&path, None, &CENTER).unwrap();
    assert_eq!(m.source.format, "nist");
    assert_eq!((m.directions.len(), m.total()), (1824, 1824));
    assert_eq!(m.remarks, [Remark::Unpolarised]);
    let wavelengths: Vec<f64> = m.channels.iter().filter_map(|c| c.wavelength_nm).collect();
    assert_eq!(wavelengths, [351.0, 532.0, 633.0, 1064.0]);
    for (channel, expected) in [
        [571.023, 180.033_513, -314.990_972_372_196, 12.064_245_812_084_5, 280.664_846_997_197],
        [571.143, 180.193_819, -313.263_080_194_766, 12.522_745_697_459_3, 281.686_483_490_594],
        [571.407, 180.430_841, -313.443_077_441_004, 12.826_145_640_771, 281.793_617_437_453],
        [571.418, 180.680_862, -313.832_396_213_023, 13.876_345_373_094_3, 281.815_438_190_06],
    ]
    .into_iter()
    .enumerate()
    {
        for (found, expected) in sums(&m, channel).into_iter().zip(expected) {
            assert_relative_eq!(found, expected, max_relative = 1e-10);
        }
    }
}

/// Lines by hand: a negative angle lies half a turn further, and phi turns the sample.
#[test]
fn ptfe_by_hand() {
    let header = "lambda,thetai,phi,thetar,phir,f_r11,f_r12/f_r11\n";
    let text = format!(
        "{header}0.633,-75,0,80,-24,0.66,0\n0.633,-75,10,91,0,9,0\n0.351,-75,0,80,-24,0.5,0\n0.351,-75,10,-10,0,0.2,0\n\
         0.351,-75,10,91,0,9,0\n0.633,-75,10,-10,0,-0.3,0\n0.351,-75,0,80,-24,0.7,0\n0.633,-75,0,80,-24,0.8,0\n"
    );
    let m = parsed("nist", &text);
    assert_eq!(m.channels, [Channel::at_wavelength(351.0), Channel::at_wavelength(633.0)]);
    assert_eq!(
        m.values,
        [vec![0.5, 0.2, 0.7], vec![0.66, -0.3, 0.8]],
        "the third is the first, measured again"
    );
    assert_eq!((m.dropped["below-horizon"], m.total()), (1, 4));
    let g = geometries(&m);
    assert_direction(g[0].wi, 75.0_f64.to_radians(), PI, 1e-15);
    assert_direction(g[0].wo, 80.0_f64.to_radians(), -24.0_f64.to_radians(), 1e-15);
    assert_direction(g[1].wi, 75.0_f64.to_radians(), 190.0_f64.to_radians(), 1e-15);
    assert_direction(g[1].wo, 10.0_f64.to_radians(), 190.0_f64.to_radians(), 1e-15);
    // Half the wavelengths at a direction are no spectrum.
    let uneven = format!("{header}0.633,0,0,10,0,0.6,0\n0.351,0,0,20,0,0.6,0\n");
    let message = parse("nist", uneven.as_bytes(), &CENTER).unwrap_err().to_string();
    assert!(message.contains("x:2: expected these directions at all 2 wavelengths"), "{message}");
}

/// Sums of f, f^2, f wi.x, f wo.x and f cos_i cos_o.
const METALS: [(&str, [f64; 5]); 12] = [
    (
        "aluminium",
        [37972.0726941649, 105107985.888456, 33009.3326343255, -33048.1128477263, 7701.20690631445],
    ),
    (
        "aluminium_anodised",
        [14093.7406988967, 35111995.883509, 13858.5907981473, -13857.1469807689, 391.907045077761],
    ),
    (
        "aluminium_ground",
        [48509.3571114883, 133642290.680915, 41723.2158819883, -41795.5079972103, 10351.8315679401],
    ),
    (
        "aluminium_sandblasted",
        [3645.68404669664, 2745104.47669638, 3558.16250339161, -3564.10601662436, 115.34545085041],
    ),
    ("brass", [44724.0395204742, 152603840.930261, 40387.8511149479, -40293.8175497723, 6947.97280220945]),
    ("copper", [41920.4038394229, 82204989.5838533, 35557.7605825842, -35709.4979290687, 9543.82645882413]),
    (
        "galvanised_steel",
        [23576.7131281824, 31068115.0241798, 21157.1369285312, -21237.2222240538, 3749.45843731919],
    ),
    (
        "ref_lacquer_rough",
        [7975.58800110335, 10653283.8012235, 7912.43301482968, -7914.57266288722, 107.120137501651],
    ),
    (
        "ref_lacquer_smooth",
        [16407.9886607804, 55008073.5414639, 16212.6932394724, -16222.016181267, 356.853981583069],
    ),
    (
        "stainless",
        [26872.3244964098, 54961070.2691459, 24207.8932533401, -24197.1604857067, 4224.51946846696],
    ),
    (
        "stainless_brushed",
        [21136.724083282, 37366877.9609813, 18986.6587535432, -19174.1863718323, 2855.32024184059],
    ),
    (
        "steel_sandblasted",
        [4120.0364956256, 3120391.97494594, 4029.27278539668, -4034.94894062545, 123.810014583564],
    ),
];

#[test]
fn metals() {
    let Some(path) = shared("mwir/mwir_metals_lacquers.csv") else { return };
    for (name, expected) in METALS {
        let m = read(&path, None, &ReadOptions::new().with_material(name)).unwrap();
        assert_eq!(m.source.format, "mwir");
        assert_eq!((m.directions.len(), m.total()), (870, 870), "{name}");
        for (found, expected) in sums(&m, 0).into_iter().zip(expected) {
            assert_relative_eq!(found, expected, max_relative = 1e-10);
        }
        let [Remark::CosineDividedOut { angle: "theta_o" }, Remark::OneMaterial { read, all }] =
            m.remarks.as_slice()
        else {
            panic!("{:?}", m.remarks)
        };
        assert!(
            read == name
                && all.len() == METALS.len()
                && METALS.iter().all(|(name, _)| all.contains(&(*name).to_owned()))
        );
    }
    let first = read(&path, None, &CENTER).unwrap();
    let named = read(&path, None, &ReadOptions::new().with_material("aluminium")).unwrap();
    assert_eq!((first.values, first.remarks), (named.values, named.remarks), "aluminium is the first");
    let message = read(&path, None, &ReadOptions::new().with_material("coper")).unwrap_err().to_string();
    assert!(
        message.contains("material: expected a material among aluminium, aluminium_anodised"),
        "{message}"
    );
    assert!(message.contains("found 'coper'; did you mean 'copper'?"), "{message}");
}

/// That the published values carry the viewer's cosine is physics: as published, f(i, o)/f(o, i) follows (cos o/cos i)^p with p
/// about 1 for nine of twelve samples; without it, with p about 0.
#[test]
fn metals_are_reciprocal() {
    let Some(path) = shared("mwir/mwir_metals_lacquers.csv") else { return };
    let mut exponents: Vec<f64> = METALS
        .iter()
        .map(|(name, _)| {
            let m = read(&path, None, &ReadOptions::new().with_material(name)).unwrap();
            let samples: Vec<(f64, f64, f64)> =
                m.directions.iter().zip(&m.values[0]).map(|(g, f)| (g.cos_i(), g.cos_o(), *f)).collect();
            let (mut square, mut product, mut pairs) = (0.0, 0.0, 0);
            for &(i, o, f) in &samples {
                let back = samples.iter().find(|(j, p, _)| (j - o).abs() + (p - i).abs() < 1e-9);
                if let Some(&(.., back)) = back
                    && o < i
                    && o > 79.9_f64.to_radians().cos() - 0.01
                {
                    let cosines = (o / i).ln();
                    square += cosines * cosines;
                    product += cosines * (f / back).ln();
                    pairs += 1;
                }
            }
            assert_eq!(pairs, 36, "{name}");
            product / square
        })
        .collect();
    exponents.sort_by(f64::total_cmp);
    let near = exponents.iter().filter(|p| p.abs() < 0.08).count();
    assert_eq!(near, 9, "{exponents:?}");
    assert!(exponents[5].abs() < 0.02, "{exponents:?}");
}

#[test]
fn metals_by_hand() {
    let text = "# made by hand\n# more\nmaterial,theta_i_deg,theta_o_deg,brdf_per_sr,L_o\n\
                a,88,0,1,1\nb,60,0,9,1\na,60,0,2,1\na,0,60,1,1\na,0,90,1,1\n";
    let m = parsed("mwir", text);
    assert_eq!(
        m.dropped.iter().map(|(k, v)| (*k, *v)).collect::<Vec<_>>(),
        [("below-horizon", 1), ("grazing-incidence", 1)]
    );
    assert_eq!(m.instrument.description.as_deref(), Some("made by hand"));
    let g = geometries(&m);
    assert_direction(g[0].wi, PI / 3.0, 0.0, 1e-15);
    assert_direction(g[1].wo, PI / 3.0, PI, 1e-15);
    assert_relative_eq!(m.values[0][0], 2.0, max_relative = 1e-15);
    assert_relative_eq!(m.values[0][1], 2.0, max_relative = 1e-15);
    let alone = parsed("mwir", "material,theta_i_deg,theta_o_deg,brdf_per_sr\na,10,20,1\n");
    assert_eq!(alone.remarks.len(), 1, "one material is no choice");
}
