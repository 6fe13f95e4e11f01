//! Which strengths of a sum are free.

use crate::model::{ParamSpec, Strength};

/// Whether a lobe reflects at a surface, and its strength is 1 in the physical model.
fn is_surface(strength: Strength, specs: &[ParamSpec]) -> bool {
    matches!(strength, Strength::Scale(_)) && specs.iter().any(|spec| spec.sharper.is_some())
}

/// Frees the strengths of lobes that reflect at a surface if there are several.
pub(super) fn free_scales_of_several(strengths: &[Strength], specs: &mut [Vec<ParamSpec>]) {
    let surfaces: Vec<usize> = (0..strengths.len().min(specs.len()))
        .filter(|lobe| is_surface(strengths[*lobe], &specs[*lobe]))
        .collect();
    if surfaces.len() < 2 {
        return;
    }
    for lobe in surfaces {
        let Strength::Scale(name) = strengths[lobe] else { continue };
        specs[lobe].iter_mut().filter(|spec| spec.name == name).for_each(|spec| spec.fixed = false);
    }
}
