//! The least-squares problem of fitting an expression to samples, processed block by block.
//!
//! For each block, every lobe evaluates its basis functions and their derivatives with respect to its shapes, which
//! all channels share. For each channel a few multiplications turn them into residuals and Jacobian columns, which are
//! appended to a triangular factor of that channel's own few parameters. The whole Jacobian is never stored: the
//! solver receives one small triangle per channel.

use super::formula::{Formula, Layout, Sums};
use super::kernels::{ChannelBlock, Combinations, ObservedBlock, Rows, Scratch, Total};
use super::loss::{LossKind, Objective, robust_deviation};
use super::observed::{BULK_OF_DATA, Observed};
use crate::geometry::{BLOCK, Block, Row};
use crate::math::count;
use crate::measurement::Samples;
use crate::model::{BasisBlock, Expression};
use crate::parameters::ParameterTable;
use crate::solver::inverse::group_sums::GroupSums;
use crate::solver::triangle::Triangle;
use crate::solver::{LeastSquares, Linearisation};
use nalgebra::DVector;
use pulp::Arch;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::{Arc, Mutex};

/// The problem of fitting an expression to samples: the two, the parameters, and the objective to minimise.
pub struct ReflectanceProblem<'a> {
    expression: &'a Expression,
    observed: Arc<Observed<'a>>,
    table: ParameterTable,
    objective: Objective,
    /// The free parameters that each channel depends on.
    layouts: Vec<Layout>,
    /// The basis of each lobe, as prepared for the previous pass, because the shapes are often the same.
    bases: Mutex<Vec<BasisBlock>>,
}

/// What a pass over the samples computes.
#[derive(Clone, Copy)]
enum Pass<'r> {
    /// The linear model: J^T J and J^T r.
    Model,
    /// sum s^2 J J^T with the standard deviations s that the file gives, the middle factor of a sandwich.
    Noise,
    /// sum e^2 J J^T, the middle factor of the sandwich.
    Scatter {
        /// R of each channel, for which |R J_s|^2 is the leverage of sample s.
        roots: &'r [Triangle],
        /// The root mean square of the residuals.
        typical: f64,
    },
}

/// The sums over a range of blocks.
struct Gathered {
    /// The compressed rows of each channel.
    triangles: Vec<Triangle>,
    /// The cost of each channel.
    costs: Vec<f64>,
    /// The cost of all channels.
    cost: f64,
}

/// Values more than this many times larger than the bulk of the data are disregarded.
const ABSURD: f64 = 1e6;
/// Largest number of ranges that the blocks are divided into for a pass. It is fixed, so that sums do not depend on
/// the number of threads.
const RANGES: usize = 64;
/// Largest number of entries of the sums over groups, over all ranges: 128 MiB.
const MOST_ENTRIES: usize = 1 << 24;
/// Least number of blocks in a range.
const BLOCKS_PER_RANGE: usize = 2;

impl<'a> ReflectanceProblem<'a> {
    /// The problem of fitting the free parameters of `table`. A metric given as the objective means least squares in
    /// that metric.
    #[must_use]
    pub fn new(
        expression: &'a Expression,
        samples: &'a Samples,
        table: ParameterTable,
        objective: impl Into<Objective>,
    ) -> Self {
        let objective = objective.into();
        let observed = Arc::new(Observed::new(samples, objective.metric));
        Self::of(expression, observed, table, objective)
    }

    /// The same problem for samples that were already prepared in the metric of `objective`.
    pub(in crate::fit) fn of(
        expression: &'a Expression,
        observed: Arc<Observed<'a>>,
        table: ParameterTable,
        objective: Objective,
    ) -> Self {
        let layout =
            |channel| if observed.counts(channel) { Layout::new(&table, channel) } else { Layout::default() };
        let layouts = (0..observed.channels()).map(layout).collect();
        Self { expression, observed, table, objective, layouts, bases: Mutex::default() }
    }

    /// The parameters, at the values they were last set to.
    #[must_use]
    pub fn table(&self) -> &ParameterTable {
        &self.table
    }

    pub(in crate::fit) fn objective(&self) -> Objective {
        self.objective
    }

    /// Square root of the sum of squares of the measured values, weighted and transformed like the residuals.
    #[must_use]
    pub fn magnitude(&self) -> f64 {
        self.observed.magnitude2().sqrt()
    }

    /// The same, limited so that a single absurdly large value does not make everything else negligible.
    pub(in crate::fit) fn plausible_magnitude(&self) -> f64 {
        let bulk = self.observed.quantile(BULK_OF_DATA);
        self.magnitude().min(ABSURD * count(self.residuals()).sqrt() * bulk)
    }

    /// Number of residuals.
    #[must_use]
    pub fn residuals(&self) -> usize {
        self.observed.residuals()
    }

    /// The largest number of free parameters that a channel depends on.
    pub(in crate::fit) fn most_columns(&self) -> usize {
        self.layouts.iter().map(|layout| layout.columns().len()).max().unwrap_or(0)
    }

    /// Rows whose products with themselves add up to sum J_s J_s^T e_s^2 at `x`, the middle factor of the sandwich
    /// covariance, in the blocks of the linear model. e_s is the residual that sample s would have in a fit without
    /// it. `root` returns, for the parameters of a channel, the rows of a matrix whose product with its transpose is
    /// their part of (J^T J)^-1. `typical` is the root mean square of the residuals.
    #[must_use]
    pub fn scatter(
        &self,
        x: &DVector<f64>,
        root: impl Fn(&[usize]) -> Vec<Vec<f64>>,
        typical: f64,
    ) -> Linearisation {
        let of_channel = |layout: &Layout| {
            let mut triangle = Triangle::new(layout.columns().len());
            triangle.append(&mut root(layout.columns()));
            triangle
        };
        let roots: Vec<Triangle> = self.layouts.iter().map(of_channel).collect();
        self.pass(x, Pass::Scatter { roots: &roots, typical })
    }

    /// Rows whose products with themselves add up to the middle factor of the sandwich covariance at `x`, from the standard deviations
    /// that the file gives; `None` if the weights follow from just these.
    #[must_use]
    pub(in crate::fit) fn given_noise(&self, x: &DVector<f64>) -> Option<Linearisation> {
        self.observed.has_noise().then(|| self.pass(x, Pass::Noise))
    }

    /// The robust standard deviation of the residuals at `x`, in the units of a loss's scale.
    #[must_use]
    pub fn residual_deviation(&self, x: &DVector<f64>) -> f64 {
        let mut table = self.table.clone();
        table.set_coordinates(x.as_slice());
        let context = Context::new(self, &table, Pass::Model);
        let residuals: Vec<Vec<(f64, f64)>> = block_ranges(self.observed.len())
            .into_par_iter()
            .map_init(|| context.workspace(), |work, blocks| context.plain_residuals(blocks, work))
            .collect();
        robust_deviation(&mut residuals.concat())
    }

    /// The residuals at `x` by channel and sample, without the weights of the samples; NaN where nothing was measured, and none for
    /// channels that do not count.
    #[must_use]
    pub(crate) fn residuals_of_channels(&self, x: &DVector<f64>) -> Vec<Vec<f64>> {
        let mut table = self.table.clone();
        table.set_coordinates(x.as_slice());
        let context = Context::new(self, &table, Pass::Model);
        let mut work = context.workspace();
        let mut rows = vec![Vec::with_capacity(self.observed.len()); self.layouts.len()];
        for blocks in block_ranges(self.observed.len()) {
            for index in blocks {
                let of_channels = context.plain_residuals_of(index, &mut work);
                for (channel, (row, residuals)) in rows.iter_mut().zip(of_channels).enumerate() {
                    let Some(residuals) = residuals else { continue };
                    let measured = residuals.iter().zip(self.observed.measured(channel, index));
                    row.extend(measured.map(|(r, measured)| if measured { *r } else { f64::NAN }));
                }
            }
        }
        rows
    }

    /// Sums over the groups of samples at `x`, for each channel in its block of the linear model; `group_of` has the group of each sample,
    /// below `groups`. A channel that does not count has empty sums.
    #[must_use]
    pub(in crate::fit) fn group_sums(
        &self,
        x: &DVector<f64>,
        groups: usize,
        group_of: &[u32],
    ) -> Vec<GroupSums> {
        assert_eq!(group_of.len(), self.observed.len(), "a group for each sample");
        let table = self.table_at(x);
        let context = Context::new(self, &table, Pass::Model);
        let size: usize = self.layouts.iter().map(|layout| GroupSums::size(layout.columns().len())).sum();
        let most = (MOST_ENTRIES / (groups * size).max(1)).clamp(1, RANGES);
        let sums: Vec<Vec<GroupSums>> = at_most(most, self.observed.len())
            .into_par_iter()
            .map_init(
                || context.workspace(),
                |work, blocks| context.sum_groups(blocks, work, groups, group_of),
            )
            .collect();
        // In order, so that the result does not depend on the threads.
        let mut sums = sums.into_iter();
        let mut total = sums.next().unwrap_or_else(|| context.no_sums(groups));
        for part in sums {
            total.iter_mut().zip(&part).for_each(|(total, part)| total.merge(part));
        }
        total
    }

    /// Adds up what the samples say of each of `number` combinations of parameters at `x`, all channels together: `add` is given the sum
    /// so far, which begins as its default, and what each sample of a block says. Returns the sums of each range of blocks, in order.
    /// `combinations` has those that a channel takes part in, each with its weights of the channel's columns.
    #[must_use]
    pub(in crate::fit) fn shares<S: Clone + Default + Send>(
        &self,
        x: &DVector<f64>,
        combinations: &[Combinations],
        number: usize,
        add: impl Fn(&mut S, &[f64]) + Sync,
    ) -> Vec<Vec<S>> {
        assert_eq!(combinations.len(), self.layouts.len(), "combinations of each channel");
        let table = self.table_at(x);
        let context = Context::new(self, &table, Pass::Model);
        block_ranges(self.observed.len())
            .into_par_iter()
            .map_init(
                || context.workspace(),
                |work, blocks| context.shares(blocks, work, combinations, number, &add),
            )
            .collect()
    }

    /// The cost of each channel at `x`.
    pub(in crate::fit) fn channel_costs(&self, x: &DVector<f64>) -> Vec<f64> {
        self.gather(x, Pass::Model).map_or_else(|| vec![0.0; self.layouts.len()], |total| total.costs)
    }

    /// Makes a pass over all samples and assembles the result.
    fn pass(&self, x: &DVector<f64>, kind: Pass<'_>) -> Linearisation {
        self.gather(x, kind).map_or_else(
            || Linearisation { cost: 0.0, blocks: Vec::new(), costs: Vec::new() },
            |total| self.assemble(&total),
        )
    }

    /// The parameters at `x`, where derivatives exist.
    fn table_at(&self, x: &DVector<f64>) -> ParameterTable {
        let mut table = self.table.clone();
        table.set_coordinates(x.as_slice());
        table.off_zero()
    }

    /// The sums over all samples at `x`; `None` without samples.
    fn gather(&self, x: &DVector<f64>, kind: Pass<'_>) -> Option<Gathered> {
        let table = self.table_at(x);
        let context = Context::new(self, &table, kind);
        let gathered: Vec<Gathered> = block_ranges(self.observed.len())
            .into_par_iter()
            .map_init(|| context.workspace(), |work, blocks| context.gather(blocks, work))
            .collect();

        let mut gathered = gathered.into_iter();
        let mut total = gathered.next()?;
        for part in gathered {
            total.cost += part.cost;
            total.costs.iter_mut().zip(&part.costs).for_each(|(total, cost)| *total += cost);
            for (triangle, other) in total.triangles.iter_mut().zip(&part.triangles) {
                triangle.merge(other);
            }
        }
        Some(total)
    }

    /// Turns the triangles of the channels into blocks of rows.
    fn assemble(&self, total: &Gathered) -> Linearisation {
        let channels = self.layouts.iter().zip(&total.triangles);
        let blocks = channels.map(|(layout, triangle)| triangle.as_rows(layout.columns()));
        Linearisation { cost: total.cost, blocks: blocks.collect(), costs: total.costs.clone() }
    }
}

/// Divides the blocks of `samples` samples into ranges that do not depend on the number of threads.
pub(in crate::fit) fn block_ranges(samples: usize) -> Vec<Range<usize>> {
    at_most(RANGES, samples)
}

/// Divides the blocks of `samples` samples into at most `ranges` ranges.
fn at_most(ranges: usize, samples: usize) -> Vec<Range<usize>> {
    let blocks = samples.div_ceil(BLOCK);
    let length = blocks.div_ceil(ranges).max(BLOCKS_PER_RANGE);
    (0..blocks).step_by(length).map(|start| start..blocks.min(start + length)).collect()
}

/// The data that one pass needs at every block.
struct Context<'p, 'a> {
    problem: &'p ReflectanceProblem<'a>,
    kind: Pass<'p>,
    formula: Formula<'p>,
    arch: Arch,
}

/// The working space of one thread.
struct Workspace {
    block: Block,
    /// The basis of each lobe.
    bases: Vec<BasisBlock>,
    scratch: Scratch,
}

impl<'p, 'a> Context<'p, 'a> {
    fn new(problem: &'p ReflectanceProblem<'a>, table: &ParameterTable, kind: Pass<'p>) -> Self {
        let formula = Formula::new(problem.expression, table, &problem.layouts, &problem.bases);
        Self { problem, kind, formula, arch: Arch::new() }
    }

    fn workspace(&self) -> Workspace {
        Workspace { block: Block::new(), bases: self.formula.bases(), scratch: Scratch::default() }
    }

    /// Computes the sums over the samples of `blocks`.
    fn gather(&self, blocks: Range<usize>, work: &mut Workspace) -> Gathered {
        let layouts = &self.problem.layouts;
        let mut result = Gathered {
            triangles: layouts.iter().map(|layout| Triangle::new(layout.columns().len() + 1)).collect(),
            costs: vec![0.0; layouts.len()],
            cost: 0.0,
        };
        for index in blocks {
            let triangles = result.triangles.iter_mut().map(Total::Triangle);
            self.block_into(index, work, triangles, |channel, cost| {
                result.costs[channel] += cost;
                result.cost += cost;
            });
        }
        result
    }

    /// Computes the rows of one block for each channel that counts, adds them to the channel's total, and hands over the channel's cost.
    fn block_into<'t>(
        &self,
        index: usize,
        work: &mut Workspace,
        totals: impl Iterator<Item = Total<'t>>,
        mut cost: impl FnMut(usize, f64),
    ) {
        let Workspace { block, bases, scratch } = work;
        let block = self.problem.observed.block(index, block);
        bases.iter_mut().for_each(BasisBlock::forget);
        for (channel, (sums, total)) in self.formula.sums().iter().zip(totals).enumerate() {
            let Some(observed) = self.problem.observed.channel_block(channel, index) else { continue };
            self.formula.evaluate(channel, block, bases);
            let kernel = self.kernel(channel, observed, block, bases, sums, scratch);
            cost(channel, self.arch.dispatch(kernel.compressed_into(total)));
        }
    }

    /// Empty sums of each channel over `groups` groups.
    fn no_sums(&self, groups: usize) -> Vec<GroupSums> {
        self.problem.layouts.iter().map(|layout| GroupSums::new(groups, layout.columns().len())).collect()
    }

    /// Computes the sums of each channel over `groups` groups of the samples of `blocks`.
    fn sum_groups(
        &self,
        blocks: Range<usize>,
        work: &mut Workspace,
        groups: usize,
        group_of: &[u32],
    ) -> Vec<GroupSums> {
        let mut result = self.no_sums(groups);
        for index in blocks {
            let group_of = &group_of[index * BLOCK..group_of.len().min((index + 1) * BLOCK)];
            let totals = result.iter_mut().map(|sums| Total::Groups(sums, group_of));
            self.block_into(index, work, totals, |_, _| ());
        }
        result
    }

    /// Adds up what the samples of `blocks` say of each combination of parameters.
    fn shares<S: Clone + Default>(
        &self,
        blocks: Range<usize>,
        work: &mut Workspace,
        combinations: &[Combinations],
        number: usize,
        add: &impl Fn(&mut S, &[f64]),
    ) -> Vec<S> {
        let mut result = vec![S::default(); number];
        let mut of_samples = vec![Row::filled(0.0); number];
        let mut of_channels: Vec<Vec<Row>> =
            combinations.iter().map(|combinations| vec![Row::filled(0.0); combinations.len()]).collect();
        for index in blocks {
            let totals = combinations.iter().zip(&mut of_channels);
            let totals = totals.map(|(combinations, squares)| Total::Squares(combinations, squares));
            self.block_into(index, work, totals, |_, _| ());
            of_samples.iter_mut().for_each(|row| row.fill(0.0));
            let squares = combinations.iter().flatten().zip(of_channels.iter().flatten());
            for ((place, _), squares) in squares {
                of_samples[*place].iter_mut().zip(squares).for_each(|(sum, square)| *sum += square);
            }
            let samples = self.problem.observed.weights(index).len();
            result.iter_mut().zip(&of_samples).for_each(|(sum, row)| add(sum, &row[..samples]));
        }
        result
    }

    /// Collects the inputs for the work on one channel of one block.
    fn kernel<'k>(
        &'k self,
        channel: usize,
        observed: ObservedBlock<'k>,
        block: &'k Block,
        bases: &'k [BasisBlock],
        sums: &'k Sums,
        scratch: &'k mut Scratch,
    ) -> ChannelBlock<'k> {
        ChannelBlock {
            observed,
            cos_i: block.cos_i(),
            objective: self.problem.objective,
            bases,
            reflectance: sums.reflectance(),
            columns: sums.columns(),
            scratch,
            rows: match self.kind {
                Pass::Model => Rows::Model,
                Pass::Noise => Rows::Noise,
                Pass::Scatter { roots, typical } => Rows::Scatter { root: &roots[channel], typical },
            },
        }
    }

    /// The residuals of all values measured at the samples of `blocks`, each paired with its sample's weight.
    fn plain_residuals(&self, blocks: Range<usize>, work: &mut Workspace) -> Vec<(f64, f64)> {
        let observed = &self.problem.observed;
        let mut residuals = Vec::with_capacity(blocks.len() * BLOCK * self.formula.sums().len());
        for index in blocks {
            for (channel, plain) in self.plain_residuals_of(index, work).iter().enumerate() {
                let Some(plain) = plain else { continue };
                let weighted = plain.iter().copied().zip(observed.weights(index).iter().copied());
                let measured =
                    weighted.zip(observed.measured(channel, index)).filter(|(_, measured)| *measured);
                residuals.extend(measured.map(|(weighted, _)| weighted));
            }
        }
        residuals
    }

    /// The residuals of each channel in one block; `None` for channels that do not count.
    fn plain_residuals_of(&self, index: usize, work: &mut Workspace) -> Vec<Option<Row>> {
        let observed = &self.problem.observed;
        let Workspace { block, bases, scratch } = work;
        let block = observed.block(index, block);
        bases.iter_mut().for_each(BasisBlock::forget);
        let of_channel = |(channel, sums): (usize, &Sums)| {
            let of_channel = observed.channel_block(channel, index)?;
            self.formula.evaluate(channel, block, bases);
            let mut kernel = self.kernel(channel, of_channel, block, bases, sums, scratch);
            Some(self.arch.dispatch(kernel.plain()))
        };
        self.formula.sums().iter().enumerate().map(of_channel).collect()
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
        // Residuals below 1e-15 of the data are rounding errors; under a loss, residuals below 1e-15 of the bulk of
        // the data.
        let data2 = if self.objective.loss == LossKind::None {
            self.observed.magnitude2()
        } else {
            self.plausible_magnitude().powi(2)
        };
        1e-30 * data2
    }
}
