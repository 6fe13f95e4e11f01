//! A builder that sets up and runs a fit.

use crate::error::Error;
use crate::fit::{
    Budget, Fit, HoldOut, LossKind, Metric, Options, Uncertainty, checked_target, evaluate, fit,
    fit_to_target, fit_within,
};
use crate::measurement::formats::BinPosition;
use crate::measurement::{Measurement, Weighting};
use crate::model::Expression;
use crate::parameters::{Selector, SettingTexts};
use crate::progress::{Progress, Quiet};
use crate::report::{Circumstances, OptionRecord, Report, Times};
use crate::solver::{SolverKind, StopSignal};
use std::fmt;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A builder for a fit: [`Fit::of`] creates it, [`run`](FitBuilder::run) makes the fit.
///
/// Parameters are named as on the command line: `m`, with its lobe if several lobes have one, as in `lambert.kd`, and
/// with a channel to mean only that one, as in `kd.r` or `kd[700]`. A method that takes a name fails if the text
/// cannot be one. Only `run` checks whether the model has such a parameter.
///
/// ```
/// use brdfit::{Expression, Fit, Measurement, Metric};
///
/// # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/data/satin-red-paint.csv");
/// let measurement = Measurement::read(path)?;
/// let model: Expression = "lambert + cook-torrance(d=beckmann)".parse()?;
/// let fit = Fit::of(&model, &measurement).metric(Metric::Log).max_theta_deg(70.0)?.bounds("m", 0.05, 0.5)?.run()?;
/// assert!(fit.is_usable());
/// # Ok::<(), brdfit::Error>(())
/// ```
#[derive(Clone)]
#[must_use = "nothing is fitted before `run`"]
pub struct FitBuilder<'a> {
    model: &'a Expression,
    measurement: &'a Measurement,
    options: Options,
    constraints: SettingTexts,
    extent: Extent,
    timeout: Option<Duration>,
    progress: Arc<dyn Progress>,
}

/// The limit on the samples and iterations of a fit.
#[derive(Clone, Copy, Debug)]
enum Extent {
    /// The limits in the options.
    AsAsked,
    /// The limits of a budget.
    Within(Budget),
    /// The cheapest budget that reaches an error.
    Reaching(f64),
}

impl fmt::Debug for FitBuilder<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("FitBuilder")
            .field("model", &self.model.canonical())
            .field("measurement", &self.measurement.source.path)
            .field("options", &self.options)
            .field("constraints", &self.constraints)
            .field("extent", &self.extent)
            .field("timeout", &self.timeout)
            .finish_non_exhaustive()
    }
}

impl Fit {
    /// Sets up a fit of `model` to `measurement`, with the options that the command line has by default.
    ///
    /// ```
    /// use brdfit::{Expression, Fit, Measurement};
    ///
    /// # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/data/satin-red-paint.csv");
    /// let fit = Fit::of(&Expression::parse("lambert + ward")?, &Measurement::read(path)?).run()?;
    /// let roughness = fit.parameter("m")?;
    /// println!("{roughness}, which is {} +/- {:?}", roughness.value, roughness.std_error);
    /// # Ok::<(), brdfit::Error>(())
    /// ```
    pub fn of<'a>(model: &'a Expression, measurement: &'a Measurement) -> FitBuilder<'a> {
        FitBuilder {
            model,
            measurement,
            options: Options::default(),
            constraints: SettingTexts::default(),
            extent: Extent::AsAsked,
            timeout: None,
            progress: Arc::new(Quiet),
        }
    }
}

/// The comparison: the metric, the loss, and the samples.
impl FitBuilder<'_> {
    /// Minimises the differences of f cos(theta_i) in this metric. [`Metric::UnbiasedCbrt`], the default, weighs
    /// highlights and matte regions as the eye does, and noise does not bias it; with [`Metric::L2`] the highlight alone decides.
    pub fn metric(mut self, metric: Metric) -> Self {
        self.options.metric = metric;
        self
    }

    /// Down-weights samples that lie far from the model; [`LossKind::None`], least squares, by default. [`LossKind::Cauchy`]
    /// all but ignores outliers.
    pub fn loss(mut self, loss: LossKind) -> Self {
        self.options.loss = loss;
        self
    }

    /// Down-weights residuals above this size, in units of the residual, or in standard deviations for weights by
    /// sigma. By default the scale is estimated from the residuals.
    ///
    /// # Errors
    /// [`Error::Invalid`] unless it is between 1e-100 and 1e100.
    pub fn loss_scale(self, scale: f64) -> Result<Self, Error> {
        self.checked(|options| options.with_loss_scale(scale))
    }

    /// Leaves out directions whose angle of incidence or viewing is larger than this, in degrees. The default is 80,
    /// beyond which few instruments are reliable.
    ///
    /// # Errors
    /// [`Error::Invalid`] unless it is above 0 and at most 90.
    pub fn max_theta_deg(self, max_theta_deg: f64) -> Result<Self, Error> {
        self.checked(|options| {
            let filters = options.filters.clone().with_max_theta_deg(max_theta_deg);
            options.with_filters(filters)
        })
    }

    /// Sets how samples are weighted; by default by solid angle on a half/difference grid and uniformly otherwise. Use
    /// [`Weighting::Sigma`] if the standard deviations of the values are known.
    pub fn weighting(mut self, weighting: Weighting) -> Self {
        self.options.filters.weighting = Some(weighting);
        self
    }

    /// Fits at most this many samples, drawn evenly; by default all. A few thousand are enough for many tables. A
    /// budget or a target chooses the number itself.
    pub fn samples(mut self, samples: usize) -> Self {
        self.options.filters.samples = Some(samples);
        self
    }

    /// Sets the seed of all random draws, 0 by default. The same seed gives the same result.
    pub fn seed(mut self, seed: u64) -> Self {
        self.options.seed = seed;
        self.options.filters.seed = seed;
        self
    }

    fn checked(mut self, change: impl FnOnce(Options) -> Options) -> Result<Self, Error> {
        self.options = change(self.options);
        self.options.check()?;
        Ok(self)
    }
}

/// Constraints on parameters.
impl FitBuilder<'_> {
    /// Keeps a parameter at a value, in the parameter's unit.
    ///
    /// # Errors
    /// [`Error::Invalid`] if `name` cannot be that of a parameter.
    pub fn fix(mut self, name: &str, value: f64) -> Result<Self, Error> {
        Selector::parse(name)?;
        self.constraints.fix.push(format!("{name}={value}"));
        Ok(self)
    }

    /// Starts a parameter from a value, in the parameter's unit, instead of searching for one.
    ///
    /// # Errors
    /// [`Error::Invalid`] if `name` cannot be that of a parameter.
    pub fn init(mut self, name: &str, value: f64) -> Result<Self, Error> {
        Selector::parse(name)?;
        self.constraints.init.push(format!("{name}={value}"));
        Ok(self)
    }

    /// Keeps a parameter between two values, in the parameter's unit. By default each parameter has bounds of its own.
    ///
    /// # Errors
    /// [`Error::Invalid`] if `name` cannot be that of a parameter.
    pub fn bounds(mut self, name: &str, low: f64, high: f64) -> Result<Self, Error> {
        Selector::parse(name)?;
        self.constraints.bounds.push(format!("{name}={low}..{high}"));
        Ok(self)
    }

    /// Fits a parameter that is fixed by default.
    ///
    /// # Errors
    /// [`Error::Invalid`] if `name` cannot be that of a parameter.
    pub fn free(mut self, name: &str) -> Result<Self, Error> {
        Selector::parse(name)?;
        self.constraints.free.push(name.to_owned());
        Ok(self)
    }

    /// Keeps a parameter equal to another.
    ///
    /// # Errors
    /// [`Error::Invalid`] if either name cannot be that of a parameter.
    pub fn tie(mut self, name: &str, other: &str) -> Result<Self, Error> {
        Selector::parse(name)?;
        Selector::parse(other)?;
        self.constraints.tie.push(format!("{name}={other}"));
        Ok(self)
    }

    /// Gives a parameter one value per channel.
    ///
    /// # Errors
    /// [`Error::Invalid`] if `name` cannot be that of a parameter.
    pub fn per_channel(mut self, name: &str) -> Result<Self, Error> {
        Selector::parse(name)?;
        self.constraints.per_channel.push(name.to_owned());
        Ok(self)
    }

    /// Gives a parameter one value for all channels.
    ///
    /// # Errors
    /// [`Error::Invalid`] if `name` cannot be that of a parameter.
    pub fn shared(mut self, name: &str) -> Result<Self, Error> {
        Selector::parse(name)?;
        self.constraints.shared.push(name.to_owned());
        Ok(self)
    }

    /// Adds constraints given as text, in the form used on the command line: `m=0.2`, `f0=copper`, `f0=0..0.1`.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a text that does not have this form.
    pub fn constraints(mut self, texts: &SettingTexts) -> Result<Self, Error> {
        texts.settings()?;
        let SettingTexts { fix, init, bounds, free, tie, per_channel, shared } = texts;
        let own = &mut self.constraints;
        for (own, more) in [
            (&mut own.fix, fix),
            (&mut own.init, init),
            (&mut own.bounds, bounds),
            (&mut own.free, free),
            (&mut own.tie, tie),
            (&mut own.per_channel, per_channel),
            (&mut own.shared, shared),
        ] {
            own.extend_from_slice(more);
        }
        Ok(self)
    }
}

/// Uncertainty, budgets, the optimiser and limits.
impl FitBuilder<'_> {
    /// Fits the model again without some of the angles of incidence, until each has been left out once, and reports the errors on
    /// what was left out in [`Fit::held_out`]. Models are best compared by those errors. [`HoldOut::fraction`] of 0.2, which makes five
    /// more fits, is common; [`HoldOut::Each`] makes one for each angle.
    pub fn hold_out(mut self, hold_out: HoldOut) -> Self {
        self.options.hold_out = Some(hold_out);
        self
    }

    /// Takes standard errors from this source; [`Uncertainty::Clustered`] by default. [`Uncertainty::BlockBootstrap`] is
    /// for data whose errors are similar within an angle of incidence; it makes 200 short fits.
    pub fn uncertainty(mut self, uncertainty: Uncertainty) -> Self {
        self.options.uncertainty = uncertainty;
        self
    }

    /// Includes an error of the measurement's scale in standard errors: `2%`, common to all channels, or `2%,per-channel`.
    ///
    /// # Errors
    /// [`Error::Invalid`] for another text, and unless the size is above 0 and at most 100 %.
    pub fn scale_error(mut self, text: &str) -> Result<Self, Error> {
        self.options.scale_error = Some(text.parse()?);
        Ok(self)
    }

    /// Fits within a budget of samples and iterations, and reports the errors on all samples in [`Fit::errors_on_all`].
    pub fn budget(mut self, budget: Budget) -> Self {
        self.extent = Extent::Within(budget);
        self
    }

    /// Fits within the cheapest budget whose error on all samples, in the metric of the fit, is at most `error`.
    ///
    /// # Errors
    /// [`Error::Invalid`] unless it is above 0.
    pub fn target_error(mut self, error: f64) -> Result<Self, Error> {
        self.extent = Extent::Reaching(checked_target(error)?);
        Ok(self)
    }

    /// Makes the final fit with this optimiser. The default is the one to use; the others are for comparison.
    pub fn solver(mut self, solver: SolverKind) -> Self {
        self.options.solver = solver;
        self
    }

    /// Ends the final fit after this many iterations, 300 by default. Few fits take more than 20. A budget chooses the
    /// number itself.
    pub fn iterations(mut self, iterations: u64) -> Self {
        self.options.iterations = iterations;
        self
    }

    /// Stops with the best parameters so far once this time has passed since `run`.
    pub fn timeout(mut self, timeout: Duration) -> Self {
        self.timeout = Some(timeout);
        self
    }

    /// Stops with the best parameters so far once another thread sets this signal to true.
    pub fn stop(mut self, signal: StopSignal) -> Self {
        self.options.stop = Some(signal);
        self
    }

    /// Reports the progress of the fit to this listener.
    pub fn progress(mut self, progress: Arc<dyn Progress>) -> Self {
        self.progress = progress;
        self
    }
}

/// Making the fit.
impl FitBuilder<'_> {
    /// Makes the fit. A fit that does not converge is not an error: see [`Fit::is_usable`].
    ///
    /// # Errors
    /// [`Error::UnknownName`] and [`Error::Invalid`] for constraints that do not suit the model; [`Error::Unmet`] for
    /// an option that needs something that the measurement does not have, such as standard deviations to weight by;
    /// [`Error::NoSamples`] if nothing is left to fit; [`Error::Optimiser`] for a bug in this crate.
    pub fn run(&self) -> Result<Fit, Error> {
        let options = self.options()?;
        let Self { measurement, model, progress, .. } = self;
        match self.extent {
            Extent::AsAsked => fit(measurement, model, &options, progress),
            Extent::Within(budget) => fit_within(budget, measurement, model, &options, progress),
            Extent::Reaching(target) => fit_to_target(target, measurement, model, &options, progress),
        }
    }

    /// Makes the fit and its report, the one that `brdfit fit` writes.
    ///
    /// # Errors
    /// The errors of [`run`](FitBuilder::run).
    pub fn run_with_report(&self) -> Result<(Fit, Report), Error> {
        let started = Instant::now();
        let fit = self.run()?;
        let report = self.report(&fit, started.elapsed());
        Ok((fit, report))
    }

    /// Evaluates the model at the values given by [`fix`](FitBuilder::fix) and [`init`](FitBuilder::init) and computes
    /// its errors, without fitting. A parameter without a value has its default, and a warning says so.
    ///
    /// # Errors
    /// The errors of [`run`](FitBuilder::run).
    pub fn evaluate(&self) -> Result<Fit, Error> {
        evaluate(self.measurement, self.model, &self.options()?)
    }

    /// The options with the constraints parsed and the deadline set.
    fn options(&self) -> Result<Options, Error> {
        let mut options = self.options.clone().with_settings(self.constraints.settings()?);
        // A time beyond the range of the clock is never reached.
        options.deadline = self.timeout.and_then(|timeout| Instant::now().checked_add(timeout));
        Ok(options)
    }

    fn report(&self, fit: &Fit, took: Duration) -> Report {
        let seconds = took.as_secs_f64();
        let given = self.constraints.as_given().into_iter();
        let options = OptionRecord {
            target_error: match self.extent {
                Extent::Reaching(target) => Some(target),
                Extent::AsAsked | Extent::Within(_) => None,
            },
            merl_bins: BinPosition::Center.into(),
            timeout_s: self.timeout.map(|timeout| timeout.as_secs_f64()),
            parameters: given.map(|(option, text)| format!("{option} {text}")).collect(),
            ..OptionRecord::new(&self.options, fit)
        };
        let threads = rayon::current_num_threads();
        let circumstances = Circumstances {
            metric: self.options.metric,
            max_theta_deg: self.options.filters.max_theta_deg,
            options,
            // The measurement was already in memory.
            times: Times { read: 0.0, fit: seconds, total: seconds, threads },
            fitted: true,
        };
        Report::new(self.measurement, fit, &circumstances)
    }
}
