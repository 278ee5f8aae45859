//! Costs and derivatives of a fit on all drives, at many points at once. Drives run in parallel and are summed in their order, so that
//! results do not depend on timing.

use super::frame::Place;
use super::{Point, Predictor};
use crate::diagnose::likelihood::normal_equations::{Costs, NormalEquations, Products};
use crate::diagnose::likelihood::observer::{KalmanGain, design};
use crate::diagnose::likelihood::robust::Mask;
use rayon::prelude::*;

/// Number of runs whose innovations are in memory at once.
pub const BATCH: usize = 120;

/// The same computation on every drive, in parallel.
pub fn on_all<'a, P: Predictor, R: Send>(
    predictor: &P,
    masks: &'a [Mask],
    of: impl Fn(usize, f64, &'a [bool]) -> Result<R, P::Error> + Sync,
) -> Result<Vec<R>, P::Error> {
    let drives = predictor.drives();
    drives.par_iter().zip(masks).enumerate().map(|(drive, ((_, dt), mask))| of(drive, *dt, mask)).collect()
}

/// Costs of points; infinite if a run fails.
pub fn costs<P: Predictor>(predictor: &P, masks: &[Mask], places: &[Place<'_>]) -> Result<Vec<f64>, P::Error> {
    let mut sums = vec![0.0; places.len()];
    for (batch, sums) in places.chunks(BATCH).zip(sums.chunks_mut(BATCH)) {
        let points: Vec<Point> = batch.iter().map(Place::point).collect();
        let candidates: Vec<Vec<f64>> = points.iter().map(|point| point.values.clone()).collect();
        let of = |drive: usize, dt: f64, mask| {
            let observers: Vec<KalmanGain> = points.iter().map(|point| design(&point.noise, dt)).collect();
            let (distinct, run) = distinct(predictor, drive, &candidates, &observers);
            let candidates: Vec<Vec<f64>> = distinct.iter().map(|&i| candidates[i].clone()).collect();
            let observers: Vec<KalmanGain> = distinct.iter().map(|&i| observers[i]).collect();
            let mut costs = Costs::new(&observers, mask);
            let failed = predictor.residuals(drive, &candidates, &observers, &mut |stretch| costs.add(stretch))?;
            let costs = costs.finish(&failed);
            Ok(run.into_iter().map(|run| costs[run]).collect::<Vec<f64>>())
        };
        for costs in on_all(predictor, masks, of)? {
            for (sum, cost) in sums.iter_mut().zip(costs) {
                *sum += if cost.is_finite() { cost } else { f64::INFINITY };
            }
        }
    }
    for (sum, Place { frame, x }) in sums.iter_mut().zip(places) {
        *sum += frame.penalty(x);
    }
    Ok(sums)
}

/// The candidates that run differently on a drive, and for each candidate the index of the one that runs like it.
fn distinct<P: Predictor>(
    predictor: &P,
    drive: usize,
    candidates: &[Vec<f64>],
    observers: &[KalmanGain],
) -> (Vec<usize>, Vec<usize>) {
    let parameters = candidates.first().map_or(0, Vec::len);
    let acting: Vec<usize> = (0..parameters).filter(|&k| predictor.acts(drive, k)).collect();
    if acting.len() == parameters {
        return ((0..candidates.len()).collect(), (0..candidates.len()).collect());
    }
    let alike = |i: usize, j: usize| {
        observers[i] == observers[j] && acting.iter().all(|&k| candidates[i][k] == candidates[j][k])
    };
    let (mut distinct, mut run) = (Vec::<usize>::new(), Vec::new());
    for i in 0..candidates.len() {
        let known = distinct.iter().position(|&j| alike(i, j));
        run.push(known.unwrap_or(distinct.len()));
        if known.is_none() {
            distinct.push(i);
        }
    }
    (distinct, run)
}

/// Derivatives at several points.
pub fn derivatives<P: Predictor>(
    predictor: &P,
    masks: &[Mask],
    at: &[&Place<'_>],
) -> Result<Vec<NormalEquations>, P::Error> {
    let m = at.first().map_or(0, |place| place.frame.coordinates());
    let mut grams = Vec::with_capacity(at.len());
    for at in at.chunks((BATCH / (m + 1)).max(1)) {
        let mut mine: Vec<NormalEquations> = at.iter().map(|_| NormalEquations::zero(m)).collect();
        let of = |drive: usize, dt: f64, mask| {
            let mut points: Vec<Point> = Vec::new();
            // The position of each point in the batch, and the coordinates moved there.
            let mut moves: Vec<(usize, Vec<usize>)> = Vec::new();
            for place in at {
                let model = place.frame.axes.len();
                let acts = |j: usize| j >= model || predictor.acts(drive, j);
                let moved: Vec<usize> = (0..m).filter(|&j| !place.frame.is_held(j) && acts(j)).collect();
                let first = points.len();
                points.push(place.point());
                points.extend(moved.iter().map(|&j| place.moved(j).point()));
                moves.push((first, moved));
            }
            let values: Vec<Vec<f64>> = points.iter().map(|point| point.values.clone()).collect();
            let observers: Vec<KalmanGain> = points.iter().map(|point| design(&point.noise, dt)).collect();
            let products = |((first, moved), place): (&(usize, Vec<usize>), &&Place<'_>)| {
                let steps = moved.iter().map(|&j| place.frame.step(j, place.x[j])).collect();
                Products::new(*first, observers[*first..=first + moved.len()].to_vec(), steps, mask)
            };
            let mut products: Vec<Products<'_>> = moves.iter().zip(at).map(products).collect();
            let failed = predictor.residuals(drive, &values, &observers, &mut |stretch| {
                products.par_iter_mut().for_each(|products| products.add(stretch));
            })?;
            Ok((products, moves, failed))
        };
        for (products, moves, failed) in on_all(predictor, masks, of)? {
            for ((gram, products), (_, moved)) in mine.iter_mut().zip(&products).zip(&moves) {
                gram.add(products, moved, &failed);
            }
        }
        for (gram, Place { frame, x }) in mine.iter_mut().zip(at) {
            if let Some(prior) = frame.prior {
                gram.cost += frame.penalty(x);
                gram.gradient += &prior.information * frame.off(prior, x);
                gram.information += &prior.information;
            }
        }
        grams.append(&mut mine);
    }
    Ok(grams)
}
