//! (4) of [`super`], and the choice.

use std::sync::atomic::{AtomicU16, Ordering};

use rayon::ThreadPool;

use super::{Lead, MIXED, PerRung, RUNGS, Sample, bit_of, index_of, unproven};
use crate::bands::for_each_row;
use crate::lanes::both;
use crate::plane::Plane;
use crate::trajectory::rung::Rung;
use crate::trajectory::surface::is_same_surface;

/// Samples around one that are judged with it, per side: 5x5.
const REACH: u32 = 2;
/// How much worse than the best the image's rung may be on a surface of a single sample; of
/// several, this over their number.
const DOUBT: f32 = 0.5;
/// A cheaper rung may be worse than the best by this: the error of a tenth of a pixel,
const TOLERANCE: f32 = 0.002_5;
/// and this part of the best's own.
const TOLERANCE_SHARE: f32 = 0.05;
/// A rung below [`Rung::Linear`] ignores what the newest key says of motion. Where something begins
/// to move it has failed no more than the others; so it is taken only where it has not failed (an
/// error of a fifth of a pixel),
const GOOD: f32 = 0.01;
/// or where the motion field has failed by so much more.
const CLEARLY: f32 = 0.05;
/// How many tolerances the rung in use may be worse than the best; and by what part of one a
/// cheaper rung may be, so as to take its place.
const HYSTERESIS: f32 = 3.0;

/// Gives every sample its rung, and returns that of the image as a whole, which was `image`.
pub(super) fn choose(
    pool: &ThreadPool,
    image: Rung,
    samples: &Plane<Sample>,
    leads: &mut Plane<Lead>,
) -> Rung {
    leads.resize(samples.width(), samples.height());
    let (sum, count) = total(pool, samples);
    if count == 0.0 {
        leads.data_mut().fill(Lead::by(image));
        return image;
    }
    let mean = sum.map(|sum| sum / count);
    let tolerated = |rung| Preferred { rung, slack: None };
    let image = cheapest(&mean, &[tolerated(image)]);
    for_each_row(
        pool,
        leads,
        #[inline(always)]
        |row, leads| {
            let own = samples.row(row);
            for (column, (lead, sample)) in (0..).zip(leads.iter_mut().zip(own)) {
                if is_settled(sample) {
                    *lead = Lead::by(sample.lead.rung);
                    continue;
                }
                let whole = |count: f32| Preferred { rung: image, slack: Some(DOUBT / count) };
                let Some(Score { score, count, share }) = score(samples, column, row) else {
                    *lead = Lead::by(unproven(image));
                    continue;
                };
                lead.share = share;
                lead.rung = if sample.keys > 1 {
                    cheapest(&score, &[tolerated(sample.lead.rung), whole(count)])
                } else {
                    cheapest(&score, &[whole(count)])
                };
            }
        },
    );
    image
}

/// Sum of m over the samples that something is known of, and their number: row by row, so that
/// threads can share them.
fn total(pool: &ThreadPool, samples: &Plane<Sample>) -> (PerRung, f32) {
    let mut rows = Plane::new(1, samples.height());
    for_each_row(
        pool,
        &mut rows,
        #[inline(always)]
        |row, total: &mut [(PerRung, f32)]| {
            let (sum, count) = &mut total[0];
            for sample in samples.row(row).iter().filter(|sample| sample.keys > 0) {
                for (sum, mean) in sum.iter_mut().zip(sample.mean) {
                    *sum += mean;
                }
                *count += 1.0;
            }
        },
    );
    let mut total = (PerRung::default(), 0.0);
    for (sum, count) in rows.data() {
        for (total, sum) in total.0.iter_mut().zip(sum) {
            *total += sum;
        }
        total.1 += count;
    }
    total
}

/// Whether the rung of a sample goes without saying: [`Rung::Linear`] or [`Rung::Hold`], which has
/// met some keys to a tenth of a pixel, this one along both axes, while the cheaper ones have not
/// met them at all.
#[inline(always)]
fn is_settled(sample: &Sample) -> bool {
    let index = index_of(sample.lead.rung);
    let cheaper = &sample.mean[..index.min(index_of(Rung::Linear))];
    sample.keys > 1
        && sample.share == [Lead::WHOLE; 2]
        && index <= index_of(Rung::Linear)
        && sample.mean[index] <= TOLERANCE
        && cheaper.iter().all(|mean| *mean > CLEARLY)
}

/// Marks for every sample whether those around it take its rung. `whole` is between two steps.
/// Returns which rungs are taken, as [`super::Evidence::taken`].
pub(super) fn share(
    pool: &ThreadPool,
    leads: &Plane<Lead>,
    whole: &mut Plane<u8>,
    shared: &mut Plane<u8>,
) -> u16 {
    let [width, height] = [leads.width(), leads.height()];
    whole.resize(width, height);
    shared.resize(width, height);
    let taken = AtomicU16::new(0);
    for_each_row(
        pool,
        whole,
        #[inline(always)]
        |row, whole| {
            let mut bits = 0;
            for (whole, lead) in whole.iter_mut().zip(leads.row(row)) {
                bits |= bit_of(lead.rung);
                *whole = if lead.is_whole() { index_of(lead.rung) as u8 } else { MIXED };
            }
            taken.fetch_or(bits, Ordering::Relaxed);
        },
    );
    let whole = &*whole;
    for_each_row(
        pool,
        shared,
        #[inline(always)]
        |row, shared| {
            let rows = [row.saturating_sub(1), row, (row + 1).min(height - 1)];
            let [above, own, below] = rows.map(|row| &whole.row(row)[..shared.len()]);
            for ((shared, own), (above, below)) in
                shared.iter_mut().zip(own).zip(above.iter().zip(below))
            {
                *shared = if (above == own) & (below == own) { *own } else { MIXED };
            }
            // Of the columns beside one, the left one has been overwritten.
            let mut left = shared.first().copied().unwrap_or(MIXED);
            for column in 0..shared.len() {
                let here = shared[column];
                let right = shared.get(column + 1).copied().unwrap_or(here);
                shared[column] = if (left == here) & (right == here) { here } else { MIXED };
                left = here;
            }
        },
    );
    taken.into_inner()
}

/// What the samples of a surface around one say.
struct Score {
    /// (4).
    score: PerRung,
    /// Of how many samples.
    count: f32,
    /// As [`Lead::share`].
    share: [u8; 2],
}

/// One of so many samples of a surface has at least to have motion that is news: a surface jumps as
/// a whole, and a vector that is wrong alone is none of its neighbours' business.
const NEWS_OF: u32 = 2;

/// [`Score`] at one sample; None where nothing is known of the surface.
#[inline(always)]
fn score(samples: &Plane<Sample>, column: u32, row: u32) -> Option<Score> {
    let (mut news, mut shares) = ([0; 2], [0; 2]);
    let depth = samples.row(row)[column as usize].depth;
    let (mut sum, mut count) = (PerRung::default(), 0.0);
    let last = [samples.width() - 1, samples.height() - 1];
    let columns = column.saturating_sub(REACH) as usize..=(column + REACH).min(last[0]) as usize;
    for row in row.saturating_sub(REACH)..=(row + REACH).min(last[1]) {
        for sample in &samples.row(row)[columns.clone()] {
            if sample.keys > 0 && is_same_surface(sample.depth, depth) {
                for (sum, mean) in sum.iter_mut().zip(&sample.mean) {
                    *sum += mean;
                }
                count += 1.0;
                for axis in 0..2 {
                    let share = sample.share[axis];
                    news[axis] += u32::from(share < Lead::WHOLE);
                    shares[axis] += if share < Lead::WHOLE { u32::from(share) } else { 0 };
                }
            }
        }
    }
    #[expect(clippy::cast_possible_truncation, reason = "the mean of sixteenths")]
    let share = both(|axis| {
        let is_news = news[axis] > 0 && (NEWS_OF * news[axis]) as f32 >= count;
        if is_news { (shares[axis] / news[axis]) as u8 } else { Lead::WHOLE }
    });
    (count > 0.0).then(|| {
        for sum in &mut sum {
            *sum /= count;
        }
        Score { score: sum, count, share }
    })
}

/// A rung that is taken before others although they are better.
struct Preferred {
    rung: Rung,
    /// By how much they may be; None for [`HYSTERESIS`] tolerances.
    slack: Option<f32>,
}

/// The first of `preferred` that is good enough, unless a cheaper one is as good as the best; else
/// the cheapest rung within the tolerance of the best.
#[inline(always)]
fn cheapest(score: &PerRung, preferred: &[Preferred]) -> Rung {
    let linear = index_of(Rung::Linear);
    let is_open = |rung: Rung| {
        let index = index_of(rung);
        index >= linear || score[index] <= GOOD || score[index] + CLEARLY < score[linear]
    };
    let open = || RUNGS.into_iter().zip(score).filter(|(rung, _)| is_open(*rung));
    let best = open().map(|(_, score)| *score).fold(f32::INFINITY, f32::min);
    let tolerance = TOLERANCE + TOLERANCE_SHARE * best;
    let cheapest_within = |slack: f32| {
        let found = open().find(|(_, score)| **score <= best + slack);
        found.map_or(Rung::Linear, |(rung, _)| rung)
    };
    let as_good = cheapest_within(tolerance / HYSTERESIS);
    for Preferred { rung, slack } in preferred {
        let slack = slack.unwrap_or(0.0).max(HYSTERESIS * tolerance);
        let index = index_of(*rung);
        if is_open(*rung) && score[index] <= best + slack && index <= index_of(as_good) {
            return *rung;
        }
    }
    cheapest_within(tolerance)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The score with these numbers for hold, global, linear, affine, quadratic and the worlds;
    /// flow has nothing to say.
    fn score(of: [f32; 6]) -> PerRung {
        [of[0], of[1], of[2], of[3], of[4], of[5], of[5], of[2]]
    }

    fn in_use(score: &PerRung, rung: Rung) -> Rung {
        cheapest(score, &[Preferred { rung, slack: None }])
    }

    #[test]
    fn the_cheapest_rung_within_the_tolerance_is_taken() {
        let clear = score([0.5, 0.5, 0.3, 0.1, 0.3, 0.2]);
        assert_eq!(in_use(&clear, Rung::Hold), Rung::Affine);
        let level = score([0.5, 0.5, 0.101, 0.1, 0.3, 0.1]);
        assert_eq!(in_use(&level, Rung::Hold), Rung::Linear);
    }

    #[test]
    fn the_rung_in_use_stays_until_it_is_clearly_worse_or_a_cheaper_one_as_good() {
        let slightly = score([0.5, 0.5, 0.115, 0.1, 0.3, 0.3]);
        assert_eq!(in_use(&slightly, Rung::Linear), Rung::Linear);
        assert_eq!(in_use(&slightly, Rung::Affine), Rung::Affine);
        let needless = score([0.5, 0.5, 0.1, 0.1, 0.3, 0.3]);
        assert_eq!(in_use(&needless, Rung::Affine), Rung::Linear);
        let clearly = score([0.5, 0.5, 0.1, 0.2, 0.3, 0.3]);
        assert_eq!(in_use(&clearly, Rung::Affine), Rung::Linear);
    }

    #[test]
    fn where_all_have_failed_alike_the_motion_field_is_believed() {
        let begins_to_move = score([0.3; 6]);
        assert_eq!(in_use(&begins_to_move, Rung::Hold), Rung::Linear);
        let field_is_wrong = score([0.3, 0.3, 0.5, 0.5, 0.5, 0.5]);
        assert_eq!(in_use(&field_is_wrong, Rung::Linear), Rung::Hold);
    }

    #[test]
    fn a_lone_sample_is_judged_as_the_image_is_and_a_surface_for_itself() {
        let (turns, flies) =
            (score([0.9, 0.9, 0.6, 0.0, 0.6, 0.6]), score([0.9, 0.9, 0.0, 0.6, 0.6, 0.6]));
        let samples = |is_turning: fn(u32, u32) -> bool| {
            crate::testing::plane(20, 20, |x, y| {
                let mean = if is_turning(x, y) { turns } else { flies };
                Sample { depth: 1 << 20, mean, keys: 2, ..Sample::default() }
            })
        };
        let pool = crate::testing::pool(2);
        let mut leads = Plane::default();
        let lone = samples(|x, y| (x, y) == (10, 10));
        assert_eq!(choose(&pool, Rung::Hold, &lone, &mut leads), Rung::Linear);
        assert_eq!(leads.at(10, 10).rung, Rung::Linear);
        let patch = samples(|x, y| x < 8 && y < 8);
        choose(&pool, Rung::Hold, &patch, &mut leads);
        assert_eq!((leads.at(3, 3).rung, leads.at(15, 15).rung), (Rung::Affine, Rung::Linear));
    }
}
