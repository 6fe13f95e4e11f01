//! The least-squares problem of fitting an expression to samples, streamed block by block.
//!
//! Per block, every lobe yields its basis functions and their derivatives with respect to its shapes,
//! shared by all channels; per channel a few multiplications turn them into residuals and Jacobian
//! columns, which go straight into a triangular factor of that channel's own few parameters. The
//! Jacobian of the whole is never stored: what reaches the solver is one small triangle per channel.

use super::least_squares::{LeastSquares, Linearisation, Rows};
use super::loss::{LossKind, Objective, robust_deviation, weighted_quantile};
use super::metric::{Metric, Transform};
use super::parameters::ParameterTable;
use super::triangle::Triangle;
use super::uncertainty::left_out;
use crate::geometry::{BLOCK, Block};
use crate::math::count;
use crate::measurement::Samples;
use crate::model::{BasisBlock, Coefficients, Expression, Role};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::ops::Range;

/// An expression, samples, and what is minimised between them.
pub struct ReflectanceProblem<'a> {
    expression: &'a Expression,
    samples: &'a Samples,
    table: ParameterTable,
    objective: Objective,
    /// Per channel.
    targets: Vec<Target>,
    /// Factor of the squared residuals: sample weights divided by the number of residuals.
    normalisation: f64,
    /// Per channel.
    layouts: Vec<Layout>,
    /// Sum of the weighted squares of g(x*).
    magnitude2: f64,
}

/// What the model is compared with in one channel.
struct Target {
    transform: Transform,
    /// g(x*) per sample.
    measured: Vec<f64>,
    /// 1/(sigma ci g'(x*)) per sample, where weights are by sigma.
    precision: Option<Vec<f64>>,
}

/// Which free parameters a channel depends on, and how.
struct Layout {
    slots: Vec<Slot>,
    /// The free parameter of each local column.
    columns: Vec<usize>,
}

/// One way in which a free parameter acts on a channel.
#[derive(Clone, Copy)]
struct Slot {
    lobe: usize,
    role: Role,
    /// Which of the lobe's shapes or amplitudes.
    index: usize,
    /// Local column.
    column: usize,
    /// Row of the parameter.
    row: usize,
}

/// What a pass over the samples gathers.
#[derive(Clone, Copy)]
enum Pass<'r> {
    /// J^T J and J^T r.
    Model,
    /// sum e^2 J J^T, the middle of the sandwich.
    Scatter {
        /// Per channel, R with |R J_s|^2 the leverage of sample s.
        roots: &'r [Triangle],
        /// Root mean square of the residuals.
        typical: f64,
    },
}

/// The result of a stretch of samples, per channel.
struct Gathered {
    triangles: Vec<Triangle>,
    cost: f64,
}

/// The most stretches that a pass is divided into. Fixed, so that sums do not depend on the threads.
const STRETCHES: usize = 64;

impl<'a> ReflectanceProblem<'a> {
    /// The problem of fitting the free parameters of `table`. A metric alone stands for its squares.
    #[must_use]
    pub fn new(
        expression: &'a Expression,
        samples: &'a Samples,
        table: ParameterTable,
        objective: impl Into<Objective>,
    ) -> Self {
        let objective = objective.into();
        let cos_i: Vec<f64> = samples.directions.iter().map(|g| g.cos_i()).collect();
        let total: f64 = samples.weights.iter().sum();
        let channels = samples.values.len();
        let normalisation = match samples.sigma {
            Some(_) => 1.0,
            None => 1.0 / (count(channels) * total),
        };
        let targets: Vec<Target> = samples
            .values
            .par_iter()
            .enumerate()
            .map(|(channel, values)| target(samples, objective.metric, &cos_i, channel, values))
            .collect();
        let magnitude2: f64 = targets
            .iter()
            .map(|t| {
                let weighted = t.measured.iter().enumerate().map(|(i, g)| {
                    let w = weight(samples, t, i);
                    w * g * g
                });
                weighted.sum::<f64>()
            })
            .sum::<f64>()
            * normalisation;
        let layouts = (0..channels).map(|channel| layout(&table, channel)).collect();
        Self { expression, samples, table, objective, targets, normalisation, layouts, magnitude2 }
    }

    /// The parameters, at the values last set.
    #[must_use]
    pub fn table(&self) -> &ParameterTable {
        &self.table
    }

    /// Root of the sum of squares of the measured values, weighted and transformed like the residuals.
    #[must_use]
    pub fn magnitude(&self) -> f64 {
        self.magnitude2.sqrt()
    }

    /// Number of residuals.
    #[must_use]
    pub fn residuals(&self) -> usize {
        self.samples.len() * self.targets.len()
    }

    /// Rows whose products make up sum J_s J_s^T e_s^2 at `x`, the middle of the sandwich covariance; e_s is
    /// the residual that its sample would have in a fit without it. `root` has a row per parameter and
    /// root root^T = (J^T J)^-1; `typical` is the root mean square of the residuals.
    #[must_use]
    pub fn scatter(&self, x: &DVector<f64>, root: &DMatrix<f64>, typical: f64) -> DMatrix<f64> {
        // A channel's own parameters need no more than their part of the inverse, as a triangle.
        let of_channel = |layout: &Layout| {
            let part = layout.columns.iter().map(|column| match root.row_iter().nth(*column) {
                Some(row) => row.iter().copied().collect(),
                None => vec![0.0; root.ncols()],
            });
            let mut triangle = Triangle::new(layout.columns.len());
            triangle.append(&mut part.collect::<Vec<_>>());
            triangle
        };
        let roots: Vec<Triangle> = self.layouts.iter().map(of_channel).collect();
        self.pass(x, Pass::Scatter { roots: &roots, typical }).matrix(x.len())
    }

    /// The robust standard deviation of the residuals at `x`, in the units of a loss's scale.
    #[must_use]
    pub fn residual_deviation(&self, x: &DVector<f64>) -> f64 {
        let mut table = self.table.clone();
        table.set_coordinates(x.as_slice());
        let values = self.formula_values(&table);
        let context = Context::new(self, &table, &values, Pass::Model);
        let residuals: Vec<Vec<(f64, f64)>> =
            self.stretches().into_par_iter().map(|range| context.plain_residuals(range)).collect();
        robust_deviation(&mut residuals.concat())
    }

    /// The magnitude below which a fraction of the measured values lie, in the units of a loss's scale;
    /// samples count alike, whatever their weight.
    #[must_use]
    pub fn data_quantile(&self, fraction: f64) -> f64 {
        let of_target = |target: &Target| -> Vec<(f64, f64)> {
            let magnitude = |(i, g): (usize, &f64)| (g.abs() * target.precision(i), 1.0);
            target.measured.iter().enumerate().map(magnitude).collect()
        };
        let mut values: Vec<(f64, f64)> = self.targets.iter().flat_map(of_target).collect();
        weighted_quantile(&mut values, fraction)
    }

    fn formula_values(&self, table: &ParameterTable) -> Vec<Vec<(Vec<f64>, Vec<f64>)>> {
        (0..self.targets.len()).map(|channel| table.formula_values(channel)).collect()
    }

    /// The samples in a fixed division.
    fn stretches(&self) -> Vec<Range<usize>> {
        let blocks = self.samples.len().div_ceil(BLOCK);
        let stretch = blocks.div_ceil(STRETCHES).max(1) * BLOCK;
        (0..self.samples.len())
            .step_by(stretch)
            .map(|start| start..self.samples.len().min(start + stretch))
            .collect()
    }

    fn pass(&self, x: &DVector<f64>, kind: Pass<'_>) -> Linearisation {
        let mut table = self.table.clone();
        table.set_coordinates(x.as_slice());
        let table = table.off_zero();
        let values = self.formula_values(&table);
        let context = Context::new(self, &table, &values, kind);
        let gathered: Vec<Gathered> =
            self.stretches().into_par_iter().map(|range| context.gather(range)).collect();

        let mut gathered = gathered.into_iter();
        let Some(mut total) = gathered.next() else {
            return Linearisation { cost: 0.0, blocks: Vec::new() };
        };
        for part in gathered {
            total.cost += part.cost;
            for (triangle, other) in total.triangles.iter_mut().zip(&part.triangles) {
                triangle.merge(other);
            }
        }
        self.assemble(&total)
    }

    /// The channels' triangles as blocks of rows.
    fn assemble(&self, total: &Gathered) -> Linearisation {
        let blocks = self.layouts.iter().zip(&total.triangles).map(|(layout, triangle)| {
            let n = layout.columns.len();
            let entry = |row: usize, column: usize| {
                let entries = triangle.rows().get(row);
                let offset = column.checked_sub(row);
                entries.zip(offset).and_then(|(e, o)| e.get(o)).copied().unwrap_or(0.0)
            };
            Rows {
                columns: layout.columns.clone(),
                jacobian: DMatrix::from_fn(n, n, entry),
                residual: DVector::from_fn(n, |row, _| entry(row, n)),
            }
        });
        Linearisation { cost: total.cost, blocks: blocks.collect() }
    }
}

impl Target {
    /// The factor that turns a residual into standard deviations; 1 where those are not given.
    fn precision(&self, sample: usize) -> f64 {
        self.precision.as_ref().map_or(1.0, |p| p.get(sample).copied().unwrap_or(0.0))
    }
}

/// Weight of the squared residual of one sample, before normalisation.
fn weight(samples: &Samples, target: &Target, sample: usize) -> f64 {
    let precision = target.precision(sample);
    samples.weights.get(sample).copied().unwrap_or(0.0) * precision * precision
}

fn target(samples: &Samples, metric: Metric, cos_i: &[f64], channel: usize, values: &[f64]) -> Target {
    let x: Vec<f64> = values.iter().zip(cos_i).map(|(f, cos)| metric.measured(f * cos)).collect();
    let weighted: f64 = x.iter().zip(&samples.weights).map(|(x, w)| x.abs() * w).sum();
    let mean = weighted / samples.weights.iter().sum::<f64>();
    let transform = metric.transform(mean);
    let precision = samples.sigma.as_ref().and_then(|sigma| sigma.get(channel)).map(|sigma| {
        let per_sample = x.iter().zip(sigma).zip(cos_i);
        per_sample.map(|((x, sigma), cos)| 1.0 / (sigma * cos * transform.apply(*x).1)).collect()
    });
    let measured = x.iter().map(|x| transform.apply(*x).0).collect();
    Target { transform, measured, precision }
}

fn layout(table: &ParameterTable, channel: usize) -> Layout {
    let mut layout = Layout { slots: Vec::new(), columns: Vec::new() };
    for lobe in 0..table.lobes().len() {
        let mut counts = [0; 2];
        for parameter in 0.. {
            let Some(index) = table.place(lobe, parameter, channel) else { break };
            let Some(row) = table.rows().get(index) else { break };
            let role = row.spec.role;
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

/// What one pass needs at every block.
struct Context<'p, 'a> {
    problem: &'p ReflectanceProblem<'a>,
    kind: Pass<'p>,
    /// Per channel, per lobe: shapes and amplitudes in formula units.
    values: &'p [Vec<(Vec<f64>, Vec<f64>)>],
    /// Per lobe: whether all channels have the same shapes.
    shared: Vec<bool>,
    /// Per lobe: whether any of its shapes is free.
    differentiated: Vec<bool>,
    /// Per channel, per lobe.
    coefficients: Vec<Vec<Coefficients>>,
    /// Per channel, per slot: d formula value/d coordinate.
    stretches: Vec<Vec<f64>>,
}

impl<'p, 'a> Context<'p, 'a> {
    fn new(
        problem: &'p ReflectanceProblem<'a>,
        table: &ParameterTable,
        values: &'p [Vec<(Vec<f64>, Vec<f64>)>],
        kind: Pass<'p>,
    ) -> Self {
        let lobes = problem.expression.lobes();
        let shapes_of =
            |channel: &[(Vec<f64>, Vec<f64>)], lobe: usize| channel.get(lobe).map(|v| v.0.clone());
        let shared = (0..lobes.len())
            .map(|lobe| {
                let first = values.first().and_then(|v| shapes_of(v, lobe));
                values.iter().all(|v| shapes_of(v, lobe) == first)
            })
            .collect();
        let differentiated = (0..lobes.len())
            .map(|lobe| {
                let slots = problem.layouts.iter().flat_map(|layout| &layout.slots);
                slots.into_iter().any(|slot| slot.lobe == lobe && slot.role == Role::Shape)
            })
            .collect();
        let coefficients = values
            .iter()
            .map(|v| v.iter().zip(lobes).map(|((_, a), lobe)| lobe.model.coefficients(a)).collect())
            .collect();
        let stretches = problem
            .layouts
            .iter()
            .map(|layout| {
                let of_slot = |slot: &Slot| {
                    table.rows().get(slot.row).map_or(0.0, |row| row.stretch() * row.spec.unit.factor())
                };
                layout.slots.iter().map(of_slot).collect()
            })
            .collect();
        Self { problem, kind, values, shared, differentiated, coefficients, stretches }
    }

    /// Runs over the samples of `range`, block by block.
    fn gather(&self, range: Range<usize>) -> Gathered {
        let layouts = &self.problem.layouts;
        let mut result = Gathered {
            triangles: layouts.iter().map(|layout| Triangle::new(layout.columns.len() + 1)).collect(),
            cost: 0.0,
        };
        let mut block = Block::new();
        let mut bases: Vec<BasisBlock> = vec![BasisBlock::default(); self.shared.len()];
        let mut scratch = Scratch::default();
        for start in range.clone().step_by(BLOCK) {
            let samples = start..range.end.min(start + BLOCK);
            self.problem.samples.directions.fill(samples.clone(), &mut block);
            for channel in 0..layouts.len() {
                self.evaluate_all(channel, &block, &mut bases);
                result.cost += self.residuals(channel, samples.clone(), &block, &bases, &mut scratch);
                if let Some(triangle) = result.triangles.get_mut(channel) {
                    triangle.append(&mut scratch.columns);
                }
            }
        }
        result
    }

    /// The residuals of all channels over the samples of `range`, each with its sample's weight.
    fn plain_residuals(&self, range: Range<usize>) -> Vec<(f64, f64)> {
        let problem = self.problem;
        let mut block = Block::new();
        let mut bases: Vec<BasisBlock> = vec![BasisBlock::default(); self.shared.len()];
        let mut f = Vec::new();
        let mut residuals = Vec::with_capacity(range.len() * problem.targets.len());
        for start in range.clone().step_by(BLOCK) {
            let samples = start..range.end.min(start + BLOCK);
            problem.samples.directions.fill(samples.clone(), &mut block);
            for (channel, (target, coefficients)) in
                problem.targets.iter().zip(&self.coefficients).enumerate()
            {
                self.evaluate_all(channel, &block, &mut bases);
                reflectance(&bases, coefficients, block.len(), &mut f);
                for ((sample, geometry), f) in samples.clone().zip(block.samples()).zip(&f) {
                    let measured = target.measured.get(sample).copied().unwrap_or(0.0);
                    let difference = target.transform.apply(f * geometry.cos_i()).0 - measured;
                    let weight = problem.samples.weights.get(sample).copied().unwrap_or(0.0);
                    residuals.push((difference * target.precision(sample), weight));
                }
            }
        }
        residuals
    }

    /// The basis of every lobe for a channel; channels with the same shapes share the first one's.
    fn evaluate_all(&self, channel: usize, block: &Block, bases: &mut [BasisBlock]) {
        for (lobe, basis) in bases.iter_mut().enumerate() {
            if channel == 0 || self.shared.get(lobe) == Some(&false) {
                self.evaluate(lobe, channel, block, basis);
            }
        }
    }

    fn evaluate(&self, lobe: usize, channel: usize, block: &Block, basis: &mut BasisBlock) {
        let model = self.problem.expression.lobes().get(lobe).map(|l| &l.model);
        let shapes = self.values.get(channel).and_then(|v| v.get(lobe)).map(|v| &v.0);
        if let (Some(model), Some(shapes)) = (model, shapes) {
            if self.differentiated.get(lobe) == Some(&true) {
                model.differentiate(block, shapes, basis);
            } else {
                model.evaluate(block, shapes, basis);
            }
        }
    }

    /// Fills `scratch.columns` with the weighted Jacobian and residuals of one channel on one block;
    /// returns their cost.
    fn residuals(
        &self,
        channel: usize,
        samples: Range<usize>,
        block: &Block,
        bases: &[BasisBlock],
        scratch: &mut Scratch,
    ) -> f64 {
        let problem = self.problem;
        let (Some(layout), Some(target), Some(coefficients), Some(stretches)) = (
            problem.layouts.get(channel),
            problem.targets.get(channel),
            self.coefficients.get(channel),
            self.stretches.get(channel),
        ) else {
            return 0.0;
        };
        let Scratch { columns, f, slope } = scratch;
        columns.resize(layout.columns.len() + 1, Vec::new());
        for column in columns.iter_mut() {
            column.clear();
            column.resize(block.len(), 0.0);
        }

        reflectance(bases, coefficients, block.len(), f);

        // Residuals, and the slope d residual/d f of each.
        let Objective { loss, scale, .. } = problem.objective;
        slope.clear();
        let mut cost = 0.0;
        let Some((residual, jacobian)) = columns.split_last_mut() else { return 0.0 };
        let measured = target.measured.get(samples.clone()).unwrap_or_default();
        let weights = problem.samples.weights.get(samples.clone()).unwrap_or_default();
        let precision = target.precision.as_ref().map(|p| p.get(samples).unwrap_or_default());
        for (i, ((geometry, f), measured)) in block.samples().iter().zip(f.iter()).zip(measured).enumerate() {
            let precision = precision.map_or(1.0, |p| p.get(i).copied().unwrap_or(0.0));
            let weight = weights.get(i).map_or(0.0, |w| (w * problem.normalisation).sqrt());
            let root = weight * precision;
            let cos_i = geometry.cos_i();
            let (g, g_slope) = target.transform.apply(f * cos_i);
            // A residual and a factor of its derivatives with the gradient and the curvature of the loss;
            // squares alone do without the detour.
            let (r, part, bend) = if loss == LossKind::None {
                let r = root * (g - measured);
                (r, r * r, 1.0)
            } else {
                let influence = loss.influence(precision * (g - measured), scale);
                let pull = root * (g - measured) * influence.slope;
                let bend = influence.curvature.sqrt();
                (pull / bend, weight * weight * influence.cost, bend)
            };
            cost += part;
            slope.push(root * bend * g_slope * cos_i);
            if let Some(entry) = residual.get_mut(i) {
                *entry = r;
            }
        }

        for (slot, stretch) in layout.slots.iter().zip(stretches) {
            let (Some(column), Some(basis), Some(lobe)) =
                (jacobian.get_mut(slot.column), bases.get(slot.lobe), coefficients.get(slot.lobe))
            else {
                continue;
            };
            // df/dshape = sum_k a_k dB_k/dshape; df/damplitude = sum_k da_k/damplitude B_k
            match slot.role {
                Role::Shape => {
                    let rows = basis.partials.get(slot.index).map_or(&[][..], Vec::as_slice);
                    for (row, coefficient) in rows.iter().zip(&lobe.values) {
                        add_scaled(column, row, coefficient * stretch);
                    }
                }
                Role::Amplitude => {
                    let partials = lobe.partials.get(slot.index).map_or(&[][..], Vec::as_slice);
                    for (row, partial) in basis.values.iter().zip(partials) {
                        add_scaled(column, row, partial * stretch);
                    }
                }
            }
        }
        for column in jacobian.iter_mut() {
            scale_each(column, slope);
        }
        if let Pass::Scatter { roots, typical } = self.kind
            && let Some(root) = roots.get(channel)
        {
            // The slopes and f have done their work; their places take the leverages and products.
            leverages(root, jacobian, slope, f);
            for (entry, leverage) in residual.iter_mut().zip(slope.iter()) {
                *entry = left_out(*entry, *leverage, typical);
            }
            for column in jacobian {
                scale_each(column, residual);
            }
        }
        cost
    }
}

/// Working space of one stretch.
#[derive(Default)]
struct Scratch {
    /// Jacobian columns, then the residuals.
    columns: Vec<Vec<f64>>,
    f: Vec<f64>,
    slope: Vec<f64>,
}

/// f = sum over lobes and basis functions, of `n` samples.
fn reflectance(bases: &[BasisBlock], coefficients: &[Coefficients], n: usize, f: &mut Vec<f64>) {
    f.clear();
    f.resize(n, 0.0);
    for (basis, lobe) in bases.iter().zip(coefficients) {
        for (row, coefficient) in basis.values.iter().zip(&lobe.values) {
            add_scaled(f, row, *coefficient);
        }
    }
}

/// Fills `sum` with |R J_s|^2 per sample, its leverage; `product` is working space.
fn leverages(root: &Triangle, jacobian: &[Vec<f64>], sum: &mut [f64], product: &mut [f64]) {
    sum.fill(0.0);
    for (k, row) in root.rows().iter().enumerate() {
        product.fill(0.0);
        for (entry, column) in row.iter().zip(jacobian.iter().skip(k)) {
            add_scaled(product, column, *entry);
        }
        for (total, entry) in sum.iter_mut().zip(product.iter()) {
            *total += entry * entry;
        }
    }
}

/// Multiplies entry by entry.
fn scale_each(column: &mut [f64], factors: &[f64]) {
    for (entry, factor) in column.iter_mut().zip(factors) {
        *entry *= factor;
    }
}

/// Adds `factor` times `row`.
pub(super) fn add_scaled(sum: &mut [f64], row: &[f64], factor: f64) {
    for (total, value) in sum.iter_mut().zip(row) {
        *total += factor * value;
    }
}

impl LeastSquares for ReflectanceProblem<'_> {
    fn linearise(&self, x: &DVector<f64>) -> Linearisation {
        self.pass(x, Pass::Model)
    }

    fn bounds(&self) -> Vec<(f64, f64)> {
        self.table.coordinate_bounds()
    }

    fn cost_floor(&self) -> f64 {
        // Residuals below 1e-15 of the data are rounding.
        1e-30 * self.magnitude2
    }
}
