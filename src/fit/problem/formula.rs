//! Evaluates an expression at one set of parameters, with its derivatives with respect to the free parameters.
//!
//! For each block of directions, every lobe evaluates its basis functions and their derivatives with respect to its
//! shapes. The reflectance f of a channel and each df/d coordinate are sums of those rows, each times a factor that
//! this module computes once per set of parameters.

use crate::geometry::Block;
use crate::model::{BasisBlock, Derivatives, Expression, LobeCoefficients, LobeValues, Role};
use crate::parameters::ParameterTable;
use std::sync::{Mutex, PoisonError};

/// One summand of a reflectance or of a derivative: a factor times a row of a lobe's basis.
#[derive(Clone, Copy, Debug)]
pub(in crate::fit) struct Term {
    pub(super) lobe: usize,
    /// The shape with respect to which the basis is differentiated; `None` for the basis itself.
    pub(super) shape: Option<usize>,
    /// Index of the basis function.
    pub(super) function: usize,
    pub(super) factor: f64,
}

/// Which free parameters a channel depends on, and how.
#[derive(Default)]
pub(super) struct Layout {
    slots: Vec<Slot>,
    columns: Vec<usize>,
}

/// One way in which a free parameter acts on a channel.
#[derive(Clone, Copy)]
struct Slot {
    lobe: usize,
    role: Role,
    /// Index among the lobe's shapes or amplitudes.
    index: usize,
    /// Index among the columns of the channel.
    column: usize,
    /// Row of the parameter table.
    row: usize,
}

impl Layout {
    pub(super) fn new(table: &ParameterTable, channel: usize) -> Self {
        let mut layout = Self::default();
        for lobe in 0..table.lobes().len() {
            let mut counts = [0; 2];
            for parameter in 0..table.parameters_of(lobe) {
                let index = table.place(lobe, parameter, channel);
                let role = table.rows()[index].spec.role;
                let [shapes, amplitudes] = &mut counts;
                let counter = if role == Role::Shape { shapes } else { amplitudes };
                let position = *counter;
                *counter += 1;
                let source = table.source(index);
                let Ok(free) = table.free().binary_search(&source) else { continue };
                let column = layout.columns.iter().position(|c| *c == free).unwrap_or_else(|| {
                    layout.columns.push(free);
                    layout.columns.len() - 1
                });
                layout.slots.push(Slot { lobe, role, index: position, column, row: source });
            }
        }
        layout
    }

    /// The free parameter of each column of the channel.
    pub(super) fn columns(&self) -> &[usize] {
        &self.columns
    }
}

/// The sums of rows that give a channel's reflectance and its derivatives.
pub(super) struct Sums {
    reflectance: Vec<Term>,
    columns: Vec<Vec<Term>>,
}

impl Sums {
    fn new(layout: &Layout, table: &ParameterTable, coefficients: &[LobeCoefficients]) -> Self {
        let mut columns = vec![Vec::new(); layout.columns.len()];
        for Slot { lobe, role, index, column, row } in layout.slots.iter().copied() {
            let of_lobe = &coefficients[lobe];
            // d(value in the formula)/d(coordinate)
            let row = &table.rows()[row];
            let slope = row.slope() * row.spec.unit.factor(row.channel);
            // df/dshape = sum_k a_k dB_k/dshape; df/damplitude = sum_k da_k/damplitude B_k
            let (shape, factors) = match role {
                Role::Shape => (Some(index), &of_lobe.values),
                Role::Amplitude => (None, &of_lobe.partials[index]),
            };
            let terms = factors.iter().enumerate().filter(|(_, factor)| **factor != 0.0);
            columns[column].extend(terms.map(|(function, factor)| Term {
                lobe,
                shape,
                function,
                factor: factor * slope,
            }));
        }
        Self { reflectance: reflectance(coefficients), columns }
    }

    pub(super) fn reflectance(&self) -> &[Term] {
        &self.reflectance
    }

    /// The terms of df/d coordinate, for each column of the channel.
    pub(super) fn columns(&self) -> &[Vec<Term>] {
        &self.columns
    }
}

/// The terms whose sum is the reflectance of a channel.
pub(in crate::fit) fn reflectance(coefficients: &[LobeCoefficients]) -> Vec<Term> {
    let of_lobe = |(lobe, of_lobe): (usize, &LobeCoefficients)| {
        let term = |(function, factor): (usize, &f64)| Term { lobe, shape: None, function, factor: *factor };
        of_lobe.values.iter().enumerate().map(term).collect::<Vec<_>>()
    };
    coefficients.iter().enumerate().flat_map(of_lobe).collect()
}

/// An expression at one set of parameters.
pub(super) struct Formula<'a> {
    expression: &'a Expression,
    /// The values of the parameters, by channel and lobe.
    values: Vec<Vec<LobeValues>>,
    /// Whether each shape of each lobe is free in any channel.
    free_shapes: Vec<Vec<bool>>,
    /// The basis of each lobe, prepared for the shapes of all channels.
    bases: Vec<BasisBlock>,
    /// The sums of each channel.
    sums: Vec<Sums>,
}

impl<'a> Formula<'a> {
    /// `layouts` has one layout per channel. `prepared` holds the bases prepared for the previous set of parameters,
    /// one per lobe, because the shapes are often the same.
    pub(super) fn new(
        expression: &'a Expression,
        table: &ParameterTable,
        layouts: &[Layout],
        prepared: &Mutex<Vec<BasisBlock>>,
    ) -> Self {
        let lobes = expression.lobes();
        let values: Vec<_> = (0..layouts.len()).map(|channel| table.formula_values(channel)).collect();
        let shapes_of = |lobe: usize| values.first().map_or(0, |of_lobes| of_lobes[lobe].shapes.len());
        let mut free_shapes: Vec<Vec<bool>> =
            (0..lobes.len()).map(|lobe| vec![false; shapes_of(lobe)]).collect();
        for slot in layouts.iter().flat_map(|layout| &layout.slots) {
            if slot.role == Role::Shape {
                free_shapes[slot.lobe][slot.index] = true;
            }
        }
        let bases = {
            let mut bases = prepared.lock().unwrap_or_else(PoisonError::into_inner);
            expression.prepare(&values, |lobe| derivatives(&free_shapes, lobe), &mut bases);
            bases.clone()
        };
        let sums = layouts.iter().zip(&values).map(|(layout, values)| {
            let coefficients: Vec<LobeCoefficients> = values
                .iter()
                .zip(lobes)
                .map(|(values, lobe)| lobe.coefficients(&values.amplitudes))
                .collect();
            Sums::new(layout, table, &coefficients)
        });
        let sums = sums.collect();
        Self { expression, values, free_shapes, bases, sums }
    }

    /// Copies of the prepared bases, for one thread to evaluate in.
    pub(super) fn bases(&self) -> Vec<BasisBlock> {
        self.bases.clone()
    }

    /// The sums that give the reflectance and its derivatives, one per channel.
    pub(super) fn sums(&self) -> &[Sums] {
        &self.sums
    }

    /// Evaluates the basis of every lobe for a channel. A basis whose shapes are the same as in the previous channel
    /// is kept.
    pub(super) fn evaluate(&self, channel: usize, block: &Block, bases: &mut [BasisBlock]) {
        let lobes = self.expression.lobes().iter().zip(&self.values[channel]).zip(bases);
        for (index, ((lobe, values), basis)) in lobes.enumerate() {
            lobe.model.evaluate(block, &values.shapes, derivatives(&self.free_shapes, index), basis);
        }
    }
}

/// The derivatives of a lobe's basis that a fit needs.
fn derivatives(free_shapes: &[Vec<bool>], lobe: usize) -> Derivatives<'_> {
    let marks = &free_shapes[lobe];
    if marks.contains(&true) { Derivatives::Of(marks) } else { Derivatives::None }
}
