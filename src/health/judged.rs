//! What each law says of a measurement: it holds, it is broken, or it was not judged, and why.

use super::ALBEDO_SLACK;
use super::Finding;
use super::channel::{MeasuredAlbedo, MeasuredChannel};
use super::laws::exchange::Cosine;
use crate::error::{OptionName, Suggestion, rounded};
use crate::measurement::Doubt;
use serde::Serialize;

/// Relative rms difference of pairs measured both ways above which a measurement is not reciprocal.
pub const RECIPROCITY_LIMIT: f64 = 0.2;
/// Relative rms difference of pairs measured both ways above which a warning is given.
pub const RECIPROCITY_WARNING: f64 = 0.05;
/// Share of directions without values from which on they are mentioned.
const NOTEWORTHY_GAP: f64 = 1e-3;
/// With more of the hemisphere than this not measured, nothing bounds the albedo from above.
const LARGEST_GAP: f64 = 0.15;

/// What a law says.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// It is broken.
    Broken,
    /// The measurement does not say.
    NotJudged,
    /// It holds.
    Holds,
}

/// A law, and what it says of a measurement.
#[derive(Clone, Debug, Serialize)]
pub struct Law {
    /// directions, sign, reciprocity or energy.
    pub law: &'static str,
    /// What it says.
    pub verdict: Verdict,
    /// Why: the figures on which the verdict rests, or what is missing.
    pub because: String,
}

/// How pairs that were measured both ways differ.
#[derive(Clone, Copy, Debug)]
pub(super) struct Exchanged {
    /// The relative root mean square difference.
    pub difference: f64,
    /// The part of it that directions may explain that agree to half a degree only.
    pub explained: f64,
    /// The number of pairs.
    pub pairs: usize,
}

/// The verdicts on a measurement, and what is to be said about them.
#[derive(Default)]
pub(super) struct Judged {
    pub laws: Vec<Law>,
    pub findings: Vec<Finding>,
}

impl Judged {
    /// Whether every law holds; `None` if some were not judged and none is broken.
    pub fn sound(&self) -> Option<bool> {
        let any = |verdict| self.laws.iter().any(|law| law.verdict == verdict);
        if any(Verdict::Broken) { Some(false) } else { (!any(Verdict::NotJudged)).then_some(true) }
    }

    fn law(&mut self, law: &'static str, verdict: Verdict, because: impl Into<String>) {
        self.laws.push(Law { law, verdict, because: because.into() });
    }

    fn find(&mut self, kind: &'static str, breaks: bool, channel: Option<&str>, text: String) {
        let channel = channel.map(str::to_owned);
        self.findings.push(Finding { kind, breaks, channel, text, suggestion: None });
    }

    /// f is never negative.
    pub fn sign(&mut self, channels: &[MeasuredChannel]) {
        for MeasuredChannel { name, negative: n, .. } in channels.iter().filter(|c| c.negative.values > 0) {
            let breaks = n.beyond_noise > 0;
            let (values, how) = if breaks {
                (n.beyond_noise, "by more than the noise")
            } else {
                (n.values, "within the noise")
            };
            let text = format!("{values} values are below 0 {how}, the lowest is {:.4e} 1/sr", n.least);
            self.find("negative", breaks, Some(name), text);
        }
        let below: usize = channels.iter().map(|channel| channel.negative.values).sum();
        let beyond: usize = channels.iter().map(|channel| channel.negative.beyond_noise).sum();
        match (below, beyond) {
            (0, _) => self.law("sign", Verdict::Holds, "no value is below 0"),
            (_, 0) => {
                self.law("sign", Verdict::Holds, format!("{below} values are below 0 within the noise"))
            }
            _ => self.law(
                "sign",
                Verdict::Broken,
                format!("{beyond} values are below 0 by more than the noise"),
            ),
        }
    }

    /// f stays the same when light and viewer change places.
    pub fn reciprocity(&mut self, by_layout: bool, exchanged: Option<Exchanged>, cosine: Option<Cosine>) {
        if let Some(cosine) = cosine {
            return self.cosine(cosine);
        }
        let Some(Exchanged { difference, explained, pairs }) = exchanged else {
            return if by_layout {
                self.law("reciprocity", Verdict::Holds, "the table holds each pair of directions once")
            } else {
                self.law("reciprocity", Verdict::NotJudged, "no pair of directions was measured both ways")
            };
        };
        let percent = |share: f64| rounded(100.0 * share, 1);
        let differ =
            format!("{pairs} pairs of directions measured both ways differ by {} % rms", percent(difference));
        // Only what the directions do not explain is the measurement's.
        let own = difference - explained;
        if difference <= RECIPROCITY_WARNING {
            return self.law("reciprocity", Verdict::Holds, differ);
        }
        let may_be = percent(explained);
        if own <= RECIPROCITY_WARNING {
            let because = format!(
                "{differ}, but their directions agree to half a degree only, within which f changes by {may_be} %"
            );
            let text = format!("cannot tell whether light and viewer may be exchanged: {because}");
            self.find("unresolved", false, None, text);
            return self.law("reciprocity", Verdict::NotJudged, because);
        }
        let breaks = own > RECIPROCITY_LIMIT;
        let but = if breaks || difference <= RECIPROCITY_LIMIT || explained == 0.0 {
            String::new()
        } else {
            format!(", of which up to {may_be} % may come from directions that agree to half a degree only")
        };
        self.find("not-reciprocal", breaks, None, differ.clone() + &but);
        if breaks {
            self.law("reciprocity", Verdict::Broken, differ);
        } else {
            let because = format!("{differ}{but}: more than they should, less than proves anything");
            self.law("reciprocity", Verdict::NotJudged, because);
        }
    }

    /// Values that differ when light and viewer change places as a cosine does.
    fn cosine(&mut self, cosine: Cosine) {
        let Cosine { of, pairs, differ: [read, otherwise] } = cosine;
        let [read, otherwise] = [read, otherwise].map(|share| rounded(100.0 * share, 0));
        let text = format!(
            "values differ by {read} % when light and viewer change places (median of {pairs} pairs), and by {otherwise} % with cos({}) divided \
             out: the file seems to hold f cos({})",
            of.name(),
            of.name()
        );
        let value = cosine.quantity().to_owned();
        let suggestion = Some(Suggestion { option: OptionName::Quantity, value });
        self.findings.push(Finding {
            kind: "not-reciprocal",
            breaks: true,
            channel: None,
            text: text.clone(),
            suggestion,
        });
        self.law("reciprocity", Verdict::Broken, text);
    }

    /// No surface reflects more light than it receives.
    pub fn energy(&mut self, channels: &[MeasuredChannel]) {
        if channels.iter().any(|channel| channel.negative.beyond_noise > 0) {
            return self.law("energy", Verdict::NotJudged, "values below 0 are no reflectance");
        }
        let mut verdicts: Vec<EnergyOfChannel> = channels.iter().map(energy_of).collect();
        // What is broken comes first, and of what is open the largest.
        verdicts.sort_by(|a, b| a.verdict.cmp(&b.verdict).then(b.albedo.total_cmp(&a.albedo)));
        for EnergyOfChannel { channel, because, .. } in
            verdicts.iter().filter(|v| v.verdict == Verdict::Broken)
        {
            self.find("gains-energy", true, Some(channel), because.clone());
        }
        if let Some(first) = verdicts.into_iter().next() {
            if first.verdict == Verdict::NotJudged && first.albedo > 1.0 {
                let text = format!("cannot tell whether an albedo is above 1: {}", first.because);
                self.find("unresolved", false, Some(&first.channel), text);
            }
            self.law("energy", first.verdict, first.because);
        }
    }

    /// The brightest samples lie where surfaces have lobes, and neighbouring directions agree.
    pub fn directions(&mut self, doubts: &[Doubt]) {
        let other = doubts.iter().find_map(|doubt| match doubt {
            Doubt::OtherReading(other) if other.is_of_angles() => Some(other),
            _ => None,
        });
        match other {
            Some(other) => self.law("directions", Verdict::NotJudged, other.to_string()),
            None => {
                self.law("directions", Verdict::Holds, "nothing speaks for another reading of the angles")
            }
        }
    }
}

/// What a channel says about energy.
struct EnergyOfChannel {
    channel: String,
    verdict: Verdict,
    /// The largest albedo that its values allow.
    albedo: f64,
    because: String,
}

fn energy_of(MeasuredChannel { name, albedo, .. }: &MeasuredChannel) -> EnergyOfChannel {
    let albedos = albedo.as_deref().unwrap_or_default();
    let of = |verdict, albedo, because| EnergyOfChannel { channel: name.clone(), verdict, albedo, because };
    let most = |key: fn(&MeasuredAlbedo) -> f64| albedos.iter().max_by(|a, b| key(a).total_cmp(&key(b)));
    let (Some(least), Some(perhaps)) = (most(|a| a.at_least), most(|a| a.at_most)) else {
        let because = "no angle of incidence has samples all over the hemisphere".to_owned();
        return of(Verdict::NotJudged, 0.0, because);
    };
    let above = |albedo: f64| albedo > 1.0 + ALBEDO_SLACK;
    let gaps = |a: &MeasuredAlbedo| match a.unmeasured {
        share if share > NOTEWORTHY_GAP => {
            format!(", and {:.1} % of the directions have no value", 100.0 * share)
        }
        _ => String::new(),
    };
    let value = |a: &MeasuredAlbedo| format!("{} +/- {:.1e}", rounded(a.value, 4), a.error);
    if above(least.at_least) {
        let (incidence, bound) = (least.incidence(), rounded(least.at_least, 4));
        let because = if least.unmeasured > NOTEWORTHY_GAP {
            format!("the albedo at theta_i {incidence} is at least {bound}, above 1{}", gaps(least))
        } else {
            format!("the albedo at theta_i {incidence} is {}, above 1", value(least))
        };
        return of(Verdict::Broken, least.at_least, because);
    }
    let incidence = perhaps.incidence();
    if above(perhaps.at_most) {
        let because = format!(
            "the sum over the samples at theta_i {incidence} is {}, where the error is that of the sum{}",
            value(perhaps),
            gaps(perhaps)
        );
        return of(Verdict::NotJudged, perhaps.at_most, because);
    }
    if perhaps.unmeasured > LARGEST_GAP {
        let because = format!(
            "{:.1} % of the directions at theta_i {incidence} have no value",
            100.0 * perhaps.unmeasured
        );
        return of(Verdict::NotJudged, perhaps.at_most, because);
    }
    let because =
        format!("the largest albedo is {}, at theta_i {incidence}{}", value(perhaps), gaps(perhaps));
    of(Verdict::Holds, perhaps.at_most, because)
}
