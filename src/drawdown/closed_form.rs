//! K and S computed exactly from two reflectances.

/// Below this u the series of artanh(sqrt u)/sqrt u is used; its first omitted term is below 1e-17.
const SERIES_BELOW: f64 = 0.01;

/// K X and S X of a film with reflectances `r` over backings of reflectance `rg`, all without the surface. `None` if no
/// film has these reflectances: it would need negative absorption or scattering, or more than infinite thickness.
///
/// With C = bSX coth(bSX), the reflectance R over Rg gives (Kubelka 1948)
///
/// ```text
/// KX (R + Rg) - SX (1 - R)(1 - Rg) + C (R - Rg) = 0
/// ```
///
/// Two of these equations determine the direction of the vector (KX, SX, C), by a cross product. Its length follows from
/// tanh^2(bSX) = KX (KX + 2 SX)/C^2, whose right side depends only on the direction. Nothing here divides by S, K or Rg.
#[must_use]
pub fn from_two_backings(r: [f64; 2], rg: [f64; 2]) -> Option<(f64, f64)> {
    let [one, two] = [(r[0], rg[0]), (r[1], rg[1])].map(|(r, rg)| (r + rg, -(1.0 - r) * (1.0 - rg), r - rg));
    let kx = one.1 * two.2 - one.2 * two.1;
    let sx = one.2 * two.0 - one.0 * two.2;
    let c = one.0 * two.1 - one.1 * two.0;
    // C is positive; dividing by it fixes the sign of the direction.
    let (kx, sx) = (kx / c, sx / c);
    let u = kx * (kx + 2.0 * sx);
    if !(kx >= 0.0 && sx >= 0.0 && u < 1.0) {
        return None;
    }
    let x_over_tanh = if u < SERIES_BELOW {
        (0..9).rev().fold(0.0, |sum, n: u32| sum * u + 1.0 / f64::from(2 * n + 1))
    } else {
        u.sqrt().atanh() / u.sqrt()
    };
    // C = x coth x = x/sqrt(u), and x = artanh(sqrt u).
    Some((kx * x_over_tanh, sx * x_over_tanh))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::parts::paint_layers::Film;
    use approx::assert_relative_eq;

    #[test]
    fn inverts_the_film() {
        for kx in [0.0, 1e-6, 0.01, 0.21, 1.3] {
            for sx in [0.0, 1e-6, 0.05, 0.84, 2.5] {
                let film = Film::new(kx, sx);
                for rg in [[0.0, 1.0], [0.05, 0.85], [0.9, 0.1]] {
                    let r = rg.map(|rg| film.over(rg));
                    // The film is so clear that rounding decides the sign of K.
                    let Some((k, s)) = from_two_backings(r, rg) else {
                        assert!(kx < 1e-12 || sx < 1e-12, "{kx} {sx} {rg:?}");
                        continue;
                    };
                    assert_relative_eq!(k, kx, max_relative = 1e-9, epsilon = 1e-13);
                    assert_relative_eq!(s, sx, max_relative = 1e-9, epsilon = 1e-13);
                }
            }
        }
    }

    /// Kubelka's own solution, with R0 over black and R over Rg: a = (R + (R0 - R + Rg)/(R0 Rg))/2.
    #[test]
    fn as_in_textbooks() {
        let film = Film::new(0.3 * 0.7, 1.2 * 0.7);
        let (r0, rg) = (film.reflectance(), 0.8);
        let r = film.over(rg);
        let a: f64 = 0.5 * (r + (r0 - r + rg) / (r0 * rg));
        let b = (a * a - 1.0).sqrt();
        let sx = 1.0 / b * ((1.0 - a * r0) / (b * r0)).recip().atanh();
        let (k, s) = from_two_backings([r0, r], [0.0, rg]).unwrap();
        assert_relative_eq!(s, sx, max_relative = 1e-12);
        assert_relative_eq!(k, (a - 1.0) * sx, max_relative = 1e-12);
        assert_relative_eq!(s, 0.84, max_relative = 1e-12);
    }

    #[test]
    fn what_no_film_reflects() {
        // Darker over white than over black; the same over both; the same backing twice; brighter than white paint.
        for (r, rg) in [
            ([0.3, 0.2], [0.0, 1.0]),
            ([0.3, 0.3], [0.0, 1.0]),
            ([0.3, 0.3], [0.5, 0.5]),
            ([0.9, 1.0], [0.0, 0.5]),
        ] {
            assert_eq!(from_two_backings(r, rg), None, "{r:?} over {rg:?}");
        }
    }
}
