//! Standard errors, intervals and correlations at the optimum.
//!
//! With H = J^T J at the optimum and J weighted like the residuals:
//!
//! - If standard deviations are given, the residuals are unit normal and the covariance is H^-1 (`absolute`).
//! - Other weights are not inverse variances, and the covariance is the sandwich H^-1 (sum e^2 J J^T) H^-1
//!   (Huber 1967, White 1980), in which each sample reveals its own noise.
//!
//! A fit follows the samples that decide it, so the residual r that remains at such a sample is smaller than its noise.
//! Hence e = r/(1 - h), where h = J_s H^-1 J_s is the leverage: the residual that the sample would have in a fit without
//! it. This is the third form of MacKinnon and White 1985 (HC3, doi:10.1016/0304-4076(85)90158-7), the jackknife of a
//! linear model.
//!
//! Both assume that the samples' errors are independent. Those of neighbouring cells of a measured table are not, so the
//! standard errors are lower limits there.
//!
//! - By default the covariance is therefore the jackknife over groups of samples that err together (`clustered`), with as many degrees of
//!   freedom for each parameter as its groups give: see `solver/inverse/jackknife`.
//!
//! Matrices over all parameters are never formed: `arrow` decomposes the model channel by channel.

use crate::fit::problem::kernels::Combinations;
use crate::math::half_interval_of_student;
use crate::measurement::ClusterKind;
use crate::parameters::ParameterTable;
use crate::solver::Linearisation;
use crate::solver::inverse::arrow::Arrow;
use crate::solver::inverse::block_matrix::BlockMatrix;
use crate::solver::inverse::group_sums::GroupSums;
use crate::solver::inverse::jackknife::{GroupedRows, Jackknife, Spread};
use nalgebra::{DMatrix, DVector};

/// The method by which the covariance was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Method {
    /// From the standard deviations given with the data.
    Absolute,
    /// From the scatter of the residuals of groups of samples that err together.
    Clustered,
    /// From the scatter of the residuals.
    Sandwich,
    /// From fits repeated on resampled angles of incidence.
    BlockBootstrap,
}

impl Method {
    /// Name in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Absolute => "absolute",
            Self::Clustered => "clustered",
            Self::Sandwich => "sandwich",
            Self::BlockBootstrap => "block-bootstrap",
        }
    }
}

/// The groups of samples from which a covariance was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grouping {
    /// What the samples of a group have in common.
    pub kind: ClusterKind,
    /// Width of a neighbourhood in the direction of the viewer, degrees; `None` for other kinds.
    pub width_deg: Option<f64>,
    /// Number of groups.
    pub groups: usize,
    /// Number of repeated fits whose scatter the errors have; `None` if the cost is a parabola, so that none were needed.
    pub refits: Option<usize>,
}

/// What the covariance is made from.
pub(super) enum Noise<'n> {
    /// The residuals have variance 1.
    Unit,
    /// Rows F with F^T F the middle factor of the sandwich, in the blocks of the model, computed once the model is decomposed.
    Rows(&'n dyn Fn(&Arrow) -> Linearisation),
    /// Groups of samples that err together, their rows in the blocks of the model, and what `Rows` has, unless
    /// there are so many samples that the errors of independent ones are no lower limit.
    Groups(Grouping, GroupedRows<'n>, Option<&'n dyn Fn(&Arrow) -> Linearisation>),
}

/// An error that all samples have in common.
pub(super) struct CommonError<'c> {
    /// J^T dr for each block of the model, with dr the change of the residuals by a standard deviation of the error.
    pub(super) slopes: Vec<DVector<f64>>,
    /// Whether each channel has an error of its own.
    pub(super) each_channel: bool,
    /// The curvature of the cost beyond that of the linear model, by block.
    pub(super) curvature: &'c [DMatrix<f64>],
}

/// The covariance of the parameters that are free and not at a bound.
#[derive(Clone, Debug)]
pub struct Covariance {
    /// The method by which it was found.
    pub method: Method,
    /// Rows of the parameter table, ascending.
    pub rows: Vec<usize>,
    /// The covariances, in the parameters' own units.
    pub(super) entries: BlockMatrix,
    /// Rows that the data do not determine, for which a standard error has no meaning.
    pub undetermined: Vec<usize>,
    /// Ratio of the largest to the smallest singular value of J with columns of unit length.
    pub condition: f64,
    /// Rows whose error would be far larger if some parameter at a bound could move. They have no standard error.
    pub dependent: Vec<usize>,
    /// Rows whose samples a loss discards, for which a standard error has no meaning either.
    pub discarded: Vec<usize>,
    /// Rows that a single group of samples decides, so that the others say nothing of their error.
    pub decided_by_one: Vec<usize>,
    /// Rows that fewer than three samples decide, whose errors cannot be told.
    pub decided_by_few: Vec<usize>,
    /// Rows that belong to the combination of parameters that is known worst.
    pub weakest: Vec<usize>,
    /// Half of the 95 % interval of each row, in standard errors. It is the larger, the less is known of the variance itself.
    pub half_intervals: Vec<f64>,
    /// The variance of each row if the residuals had variance 1, in the parameter's own unit: how flat the cost is along it.
    pub unit_variances: Vec<f64>,
    /// The groups of samples that it was found from; `None` unless samples are grouped.
    pub grouping: Option<Grouping>,
    pub(super) unbounded: Unbounded,
}

/// A parameter is decided by one group if that has more than this share in what is known of it.
const LARGEST_SHARE: f64 = 0.7;
/// A parameter belongs to a combination if its component of the unit direction is larger than this.
const IN_COMBINATION: f64 = 0.3;
/// A unit direction is not determined if its projection onto the undetermined directions is longer than this.
const IN_NULL_DIRECTION: f64 = 0.05;
/// If holding others at their bounds makes a variance this many times smaller, the smaller variance says little.
const INFLATION: f64 = 5.0;

/// The linear model in some of the parameters, and how well it determines them.
struct Known {
    /// Rows of the parameter table, ascending.
    rows: Vec<usize>,
    arrow: Arrow,
    /// H^-1, in scaled coordinates.
    inverse: BlockMatrix,
    /// The projection onto the directions that are not determined.
    unknown: BlockMatrix,
    /// The parameters' own units per unit of their scaled coordinates.
    units: DVector<f64>,
}

impl Known {
    /// The model of the `selected` columns of the Jacobian of `n` parameters; each column comes with its row of the
    /// parameter table.
    fn new(
        table: &ParameterTable,
        model: &Linearisation,
        n: usize,
        selected: &[(usize, usize)],
    ) -> Option<Self> {
        let (columns, rows): (Vec<usize>, Vec<usize>) = selected.iter().copied().unzip();
        let arrow = Arrow::new(model, n, columns)?;
        let unit = |(row, length): (&usize, &f64)| table.rows()[*row].slope() / length;
        let units = DVector::from_iterator(rows.len(), rows.iter().zip(arrow.lengths.iter()).map(unit));
        Some(Self { inverse: arrow.inverse(), unknown: arrow.unknown(), rows, arrow, units })
    }

    /// The model of the parameters in some rows of the table.
    fn of_rows(table: &ParameterTable, model: &Linearisation, rows: &[usize]) -> Option<Self> {
        let all = table.free().iter().copied().enumerate();
        let selected: Vec<(usize, usize)> = all.filter(|(_, row)| rows.binary_search(row).is_ok()).collect();
        Self::new(table, model, table.free().len(), &selected)
    }

    /// The rows of the parameters that the data do not determine.
    fn undetermined(&self) -> Vec<usize> {
        let lost = |i: usize| self.unknown.square(&[(i, 1.0)]).sqrt() > IN_NULL_DIRECTION;
        self.rows.iter().enumerate().filter(|(i, _)| lost(*i)).map(|(_, row)| *row).collect()
    }

    /// The rows that belong to the direction known worst.
    fn weakest(&self) -> Vec<usize> {
        let entries = self.arrow.weakest.iter().zip(&self.rows);
        entries.filter(|(entry, _)| entry.abs() > IN_COMBINATION).map(|(_, row)| *row).collect()
    }

    /// H^-1, or the sandwich around rows, in the parameters' own units.
    fn covariance(&self, rows: Option<&Linearisation>) -> BlockMatrix {
        let scaled = rows.map_or_else(|| self.inverse.clone(), |rows| self.arrow.sandwich(rows));
        scaled.in_units(&self.units)
    }

    /// The jackknife over groups, in the arrow's coordinates; `None` if a group cannot be left out.
    fn spread(
        &self,
        model: &Linearisation,
        rows: GroupedRows<'_>,
        scatter: Option<&Linearisation>,
    ) -> Option<Spread> {
        Some(Jackknife::new(&self.arrow, model, rows)?.spread(scatter))
    }

    /// Variances in the arrow's coordinates, in the parameters' own units.
    fn variances_in_units(&self, variances: impl Iterator<Item = f64>) -> Vec<f64> {
        variances.zip(self.units.iter()).map(|(variance, unit)| variance * unit * unit).collect()
    }
}

/// The covariance of all free parameters as if there were no bounds, including those at a bound.
#[derive(Clone, Debug)]
pub(super) struct Unbounded {
    rows: Vec<usize>,
    entries: BlockMatrix,
    /// The parameters' own units per unit of the coordinates of `unknown`.
    units: DVector<f64>,
    /// The projection onto the directions that are not determined.
    unknown: BlockMatrix,
}

impl Covariance {
    /// The covariance from the linear model and its noise. `None` if no parameter is left, if there are no degrees of freedom, or if a
    /// group cannot be left out. `dof` are the degrees of freedom of a variance that all residuals determine.
    pub(super) fn new(
        table: &ParameterTable,
        model: &Linearisation,
        method: Method,
        noise: &Noise<'_>,
        dof: f64,
    ) -> Option<Self> {
        let all: Vec<(usize, usize)> = table.free().iter().copied().enumerate().collect();
        let n = all.len();
        let at_bound = |row: usize| table.rows()[row].at_lower() || table.rows()[row].at_upper();
        let inside: Vec<(usize, usize)> = all.iter().copied().filter(|(_, row)| !at_bound(*row)).collect();
        if inside.is_empty() || dof <= 0.0 {
            return None;
        }
        let bounded = inside.len() < n;
        let inside = Known::new(table, model, n, &inside)?;
        let scatter = match noise {
            Noise::Unit | Noise::Groups(_, _, None) => None,
            Noise::Rows(rows) | Noise::Groups(_, _, Some(rows)) => Some(rows(&inside.arrow)),
        };
        if !scatter.as_ref().is_none_or(Linearisation::is_finite) {
            return None;
        }
        let all = if bounded { Known::new(table, model, n, &all) } else { None };
        let free = all.as_ref().unwrap_or(&inside);
        let scatter = scatter.as_ref();
        let (entries, of_free, spread, grouping) = match noise {
            Noise::Groups(grouping, rows, _) => {
                let spread = inside.spread(model, *rows, scatter)?;
                let entries = BlockMatrix::products(spread.rows.clone()).in_units(&inside.units);
                let of_free = if bounded {
                    let of_free = free.spread(model, *rows, scatter)?;
                    BlockMatrix::products(of_free.rows).in_units(&free.units)
                } else {
                    entries.clone()
                };
                (entries, of_free, Some(spread), Some(*grouping))
            }
            Noise::Unit | Noise::Rows(_) => {
                (inside.covariance(scatter), free.covariance(scatter), None, None)
            }
        };
        let unbounded = Unbounded {
            rows: free.rows.clone(),
            entries: of_free,
            units: free.units.clone(),
            unknown: free.unknown.clone(),
        };
        // If an error exceeds the whole range of its parameter, the data say nothing about it.
        let lost_inside = inside.undetermined();
        let mut undetermined = lost_inside.clone();
        for (i, index) in inside.rows.iter().enumerate() {
            let row = &table.rows()[*index];
            let error = entries.entry(i, i).sqrt() / row.slope();
            if !(error <= row.width() || lost_inside.contains(index)) {
                undetermined.push(*index);
            }
        }
        // Errors that would be far larger if the parameters at a bound could move, whatever the noise.
        let (held, moving) = (inside.covariance(None), free.covariance(None));
        let lost_free = free.undetermined();
        let depends = |(i, row): (usize, &usize)| {
            let j = free.rows.binary_search(row).ok()?;
            let larger = moving.entry(j, j) > INFLATION * held.entry(i, i);
            let lost = lost_free.contains(row) && !lost_inside.contains(row);
            (larger || lost).then_some(*row)
        };
        let dependent = inside.rows.iter().enumerate().filter_map(depends).collect();
        let number = inside.rows.len();
        // If sigma is given, no variance is estimated; that is the limit of Student's distribution for infinitely many degrees of freedom.
        let freedom = if method == Method::Absolute { f64::INFINITY } else { dof };
        let (half_intervals, decided_by_one, unit_variances) = match spread {
            Some(Spread { half_intervals, largest_shares, unit_variances, .. }) => {
                let shares = inside.rows.iter().zip(&largest_shares);
                let decided = shares.filter(|(_, share)| **share > LARGEST_SHARE).map(|(row, _)| *row);
                (half_intervals, decided.collect(), inside.variances_in_units(unit_variances.into_iter()))
            }
            None => {
                let diagonal = (0..number).map(|i| inside.inverse.entry(i, i));
                let half_intervals = vec![half_interval_of_student(freedom); number];
                (half_intervals, Vec::new(), inside.variances_in_units(diagonal))
            }
        };
        Some(Self {
            method,
            entries,
            dependent,
            discarded: Vec::new(),
            decided_by_one,
            decided_by_few: Vec::new(),
            condition: inside.arrow.condition,
            half_intervals,
            unit_variances,
            grouping,
            unbounded,
            weakest: inside.weakest(),
            rows: inside.rows,
            undetermined,
        })
    }

    /// All entries, row by row in the order of `rows`.
    #[must_use]
    pub fn matrix(&self) -> DMatrix<f64> {
        self.entries.dense()
    }

    /// The same with every variance `factor` times as large, estimated with `dof` degrees of freedom.
    pub(super) fn scaled(mut self, factor: f64, dof: f64) -> Self {
        let scale = |entries: &BlockMatrix| {
            entries.clone().in_units(&DVector::from_element(entries.len(), factor.sqrt()))
        };
        self.entries = scale(&self.entries);
        self.unbounded.entries = scale(&self.unbounded.entries);
        self.half_intervals.fill(half_interval_of_student(dof));
        self
    }

    /// The same with each standard error multiplied by a factor, which `refits` repeated fits gave.
    pub(super) fn widened(mut self, factors: &[f64], refits: usize) -> Self {
        assert_eq!(factors.len(), self.rows.len(), "a factor per row");
        let of_row = |row: &usize| self.rows.binary_search(row).map_or(1.0, |i| factors[i]);
        let of_unbounded =
            DVector::from_iterator(self.unbounded.rows.len(), self.unbounded.rows.iter().map(of_row));
        self.unbounded.entries = self.unbounded.entries.in_units(&of_unbounded);
        self.entries = self.entries.in_units(&DVector::from_column_slice(factors));
        if let Some(grouping) = &mut self.grouping {
            grouping.refits = Some(refits);
        }
        self
    }

    /// The same with an error that all samples have in common, beside the noise.
    pub(super) fn with_common_error(
        mut self,
        table: &ParameterTable,
        model: &Linearisation,
        error: &CommonError<'_>,
    ) -> Self {
        let no_groups: Vec<GroupSums> =
            model.blocks.iter().map(|rows| GroupSums::new(0, rows.columns.len())).collect();
        let moves = |rows: &[usize]| {
            let known = Known::of_rows(table, model, rows)?;
            let rows = GroupedRows { sums: &no_groups, curvature: error.curvature };
            let moves =
                Jackknife::new(&known.arrow, model, rows)?.moves_by(&error.slopes, error.each_channel);
            Some(moves * DMatrix::from_diagonal(&known.units))
        };
        if let Some(moves) = moves(&self.rows) {
            let known = half_interval_of_student(f64::INFINITY);
            for (i, half_interval) in self.half_intervals.iter_mut().enumerate() {
                // The variance of the common error is known; that of the noise is not.
                let (noise, common) = (self.entries.entry(i, i), moves.column(i).norm_squared());
                let square = (half_interval.powi(2) * noise + known.powi(2) * common) / (noise + common);
                if square.is_finite() {
                    *half_interval = square.sqrt();
                }
            }
            self.entries = self.entries.plus_products(&moves);
        }
        if let Some(moves) = moves(&self.unbounded.rows) {
            self.unbounded.entries = self.unbounded.entries.plus_products(&moves);
        }
        self
    }

    /// The combination of the columns of each block whose square is what a row of the model says of each parameter, apart from a common
    /// factor: for the place of each parameter among `rows` that the block involves, a weight for each of the block's columns.
    pub(super) fn combinations(
        &self,
        table: &ParameterTable,
        model: &Linearisation,
    ) -> Option<Vec<Combinations>> {
        let known = Known::of_rows(table, model, &self.rows)?;
        let place_of = |column: &usize| known.rows.binary_search(&table.free()[*column]).ok();
        let of_block = |columns: &[usize]| {
            let places: Vec<Option<usize>> = columns.iter().map(place_of).collect();
            let of_parameter = |i: &usize| {
                let weight = |place: &Option<usize>| {
                    place.map_or(0.0, |j| known.inverse.entry(*i, j) / known.arrow.lengths[j])
                };
                (*i, places.iter().map(weight).collect())
            };
            places.iter().flatten().map(of_parameter).collect()
        };
        Some(model.blocks.iter().map(|rows| of_block(&rows.columns)).collect())
    }

    /// Removes the errors of rows that too few samples decide.
    pub(super) fn decided_by_few(&mut self, rows: Vec<usize>) {
        self.decided_by_few = rows;
    }

    /// Removes the errors of some rows.
    pub(super) fn discard(&mut self, rows: Vec<usize>) {
        self.discarded = rows;
    }

    /// The position in `rows` of a row of the table; `None` if it has no error.
    fn position(&self, row: usize) -> Option<usize> {
        let no_error = [
            &self.undetermined,
            &self.dependent,
            &self.discarded,
            &self.decided_by_one,
            &self.decided_by_few,
        ];
        self.rows.binary_search(&row).ok().filter(|_| !no_error.iter().any(|rows| rows.contains(&row)))
    }

    /// The standard error of the parameter in a row of the table. `None` if the parameter is at a bound, held,
    /// undetermined, dependent, discarded, or decided by one group of samples or by few samples. Also `None` instead of 0, because data
    /// without noise do not determine how large the error is.
    #[must_use]
    pub fn std_error(&self, row: usize) -> Option<f64> {
        let i = self.position(row)?;
        Some(self.entries.entry(i, i).sqrt()).filter(|e| e.is_finite() && *e > 0.0)
    }

    /// Half of the 95 % interval of the parameter in a row of the table, in standard errors; `None` if it has no standard error.
    #[must_use]
    pub fn half_interval(&self, row: usize) -> Option<f64> {
        Some(self.half_intervals[self.position(row)?])
    }

    /// The same for a function of the parameters in several rows: the largest of them, that is, of the row whose variance is known worst.
    /// Rows without a standard error do not count.
    #[must_use]
    pub fn widest_half_interval(&self, rows: impl IntoIterator<Item = usize>) -> f64 {
        let known = rows.into_iter().filter_map(|row| self.rows.binary_search(&row).ok());
        known.map(|i| self.half_intervals[i]).fold(half_interval_of_student(f64::INFINITY), f64::max)
    }

    /// The covariance of the parameters in two rows.
    #[must_use]
    pub fn between(&self, a: usize, b: usize) -> Option<f64> {
        Some(self.entries.entry(self.position(a)?, self.position(b)?))
    }

    /// The correlation of the parameters in two rows, -1..1.
    #[must_use]
    pub fn correlation(&self, a: usize, b: usize) -> Option<f64> {
        let scale = self.std_error(a)? * self.std_error(b)?;
        if a == b {
            return Some(1.0);
        }
        (scale > 0.0).then(|| self.between(a, b).map(|c| (c / scale).clamp(-1.0, 1.0))).flatten()
    }

    /// The pairs of rows whose correlation exceeds `least` in magnitude, in order.
    pub(super) fn correlated_pairs(&self, least: f64) -> Vec<(f64, usize, usize)> {
        let known = |(i, row): (usize, &usize)| Some((i, *row, self.std_error(*row)?));
        let known: Vec<(usize, usize, f64)> = self.rows.iter().enumerate().filter_map(known).collect();
        let mut pairs = Vec::new();
        for (k, (i, a, error_a)) in known.iter().enumerate() {
            for (j, b, error_b) in known.iter().skip(k + 1) {
                let correlation = (self.entries.entry(*i, *j) / (error_a * error_b)).clamp(-1.0, 1.0);
                if correlation.abs() > least {
                    pairs.push((correlation, *a, *b));
                }
            }
        }
        pairs
    }

    /// The standard error of a sum of parameters, each given by its row and its weight.
    ///
    /// The sum may be determined even if its terms are not, or if one of them is at a bound; such a term is ignored.
    /// `None` if the sum itself is not determined, or if none of the rows is free.
    #[must_use]
    pub fn combined_error(&self, terms: &[(usize, f64)]) -> Option<f64> {
        let Unbounded { rows, entries, units, unknown } = &self.unbounded;
        if terms.iter().any(|(row, _)| self.discarded.contains(row)) {
            return None;
        }
        let place = |(row, weight): &(usize, f64)| Some((rows.binary_search(row).ok()?, *weight));
        let weights: Vec<(usize, f64)> = terms.iter().filter_map(place).collect();
        let scaled = |(i, weight): &(usize, f64)| (*i, weight * units[*i]);
        let direction: Vec<(usize, f64)> = weights.iter().map(scaled).collect();
        // The same row may occur twice.
        let along = |(i, x): &(usize, f64)| -> f64 {
            x * direction.iter().filter(|(j, _)| j == i).map(|(_, y)| y).sum::<f64>()
        };
        let length = direction.iter().map(along).sum::<f64>().sqrt();
        let lost = unknown.square(&direction).max(0.0).sqrt();
        if length == 0.0 || lost > IN_NULL_DIRECTION * length {
            return None;
        }
        Some(entries.square(&weights).max(0.0).sqrt()).filter(|error| error.is_finite() && *error > 0.0)
    }
}
