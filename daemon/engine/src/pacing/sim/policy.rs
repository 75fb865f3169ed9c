//! The pacers that a scenario can be run with.

use super::naive::NaiveTimer;
use crate::pacing::{Pacer, PacerConfig, Plan};
use crate::time::{MonoSpan, MonoTime};

/// Who plans.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Policy {
    /// [`Pacer`].
    Pacer(PacerConfig),
    /// A timer at the announced rate, without feedback or content clock.
    NaiveTimer,
}

/// A pacer at work.
#[derive(Clone, Debug)]
pub(super) enum Planner {
    Pacer(Box<Pacer>),
    Naive(NaiveTimer),
}

impl Planner {
    pub(super) fn new(policy: Policy, refresh_interval: MonoSpan) -> Self {
        match policy {
            Policy::Pacer(config) => Self::Pacer(Box::new(Pacer::new(config))),
            Policy::NaiveTimer => Self::Naive(NaiveTimer::new(refresh_interval)),
        }
    }

    pub(super) fn on_key(&mut self, content_time: MonoTime, arrived_at: MonoTime) {
        match self {
            Self::Pacer(pacer) => pacer.on_key(content_time, arrived_at, false),
            Self::Naive(timer) => timer.on_key(content_time),
        }
    }

    pub(super) fn plan(&mut self, now: MonoTime) -> Plan {
        match self {
            Self::Pacer(pacer) => pacer.plan(now),
            Self::Naive(timer) => timer.plan(now),
        }
    }

    pub(super) fn start(&mut self, plan: &Plan) {
        match self {
            Self::Pacer(pacer) => pacer.start(plan),
            Self::Naive(timer) => timer.start(plan),
        }
    }

    /// The pacer, for what a timer does not want to know.
    pub(super) fn pacer(&mut self) -> Option<&mut Pacer> {
        match self {
            Self::Pacer(pacer) => Some(pacer),
            Self::Naive(_) => None,
        }
    }
}
