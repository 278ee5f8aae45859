//! The cars of the default platoon: one kind of controller after the other, parameters within the paper's Table 3.

use super::car::{CarTruth, Controller, Lead, RoadLoad};
use super::noise::{Purpose, Stream};

/// Constant bounds of the acceleration \[m/s²\]: paper, Section 2.2.2.
const BOUNDS: (f64, f64) = (-7.0, 5.0);

/// A car of 4.9 m; the gain lets its speed vary by 0.36 m/s on 2.9 %.
pub(super) fn lead() -> Lead {
    Lead { name: "Synthetic(A)".to_owned(), length: 4.9, k: 0.8, tau_a: 0.3 }
}

/// A car of 4.7 m without delay, lag, load or effects, with the constant bounds.
fn car(controller: Controller) -> CarTruth {
    CarTruth {
        name: String::new(),
        length: 4.7,
        initial_gap: 0.0,
        controller,
        tau_p: 0.0,
        tau_a: 0.0,
        load: None,
        a_lb: BOUNDS.0,
        a_ub: BOUNDS.1,
        effects: Vec::new(),
        gusts: None,
    }
}

/// A base model to draw a follower from, by its name in files and on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, strum::EnumString, strum::IntoStaticStr, strum::VariantArray)]
#[strum(const_into_str, serialize_all = "kebab-case")]
pub enum Base {
    /// Intelligent Driver Model.
    Idm,
    /// Linear law with constant time headway.
    LCth,
    /// Gipps' model.
    Gipps,
    /// Linear law with the desired spacing of the IDM.
    LIdm,
    /// Linear law with the spacing of Gipps' model at equilibrium.
    LGipps,
}

/// A follower without delay, lag or load whose parameters are drawn from the seed, within a safe range.
pub fn drawn(base: Base, seed: u64, car: usize) -> CarTruth {
    let stream = &mut Stream::new(seed, Purpose::ParametersOfCar(car));
    let mut draw = |low: f64, high: f64| stream.between(low, high);
    let (v_0, t_h, d_0) = (draw(31.0, 35.0), draw(0.9, 1.7), draw(2.0, 4.0));
    let controller = match base {
        Base::Idm => {
            Controller::Idm { v_0, t_h, d_0, a_max: draw(1.0, 2.2), a_min: draw(-3.0, -1.2), delta: draw(2.5, 6.0) }
        }
        Base::LCth => {
            Controller::Linear { v_0, t_h, d_0, k_s: draw(0.1, 0.4), k_v: draw(0.4, 1.1), k_0: draw(0.3, 0.9) }
        }
        Base::Gipps => Controller::Gipps {
            v_0,
            t_h,
            d_0,
            a_max: draw(1.0, 2.5),
            a_min: draw(-3.2, -2.2),
            a_hat_min: draw(-3.6, -2.4),
            theta: draw(0.2, 0.6),
        },
        Base::LIdm => Controller::LinearIdm {
            v_0,
            t_h,
            d_0,
            k_s: draw(0.1, 0.4),
            k_v: draw(0.4, 1.1),
            k_0: draw(0.3, 0.9),
            a_max: draw(1.0, 2.2),
            a_min: draw(-3.0, -1.2),
        },
        Base::LGipps => Controller::LinearGipps {
            v_0,
            t_h,
            d_0,
            k_s: draw(0.1, 0.4),
            k_v: draw(0.4, 1.1),
            k_0: draw(0.3, 0.9),
            theta: draw(0.2, 0.6),
            a_min: draw(-3.2, -2.2),
            a_hat_min: draw(-3.6, -2.4),
        },
    };
    CarTruth {
        name: format!("Synthetic({})", char::from(b'A' + (car as u8).min(25))),
        initial_gap: d_0 + 0.5,
        ..self::car(controller)
    }
}

/// The four followers described at [`Scenario`](super::Scenario).
pub(super) fn followers() -> Vec<CarTruth> {
    vec![
        CarTruth {
            name: "Synthetic(B)".to_owned(),
            initial_gap: 3.2,
            tau_p: 0.3,
            tau_a: 0.4,
            ..car(Controller::Idm { v_0: 34.0, t_h: 1.0, d_0: 3.0, a_max: 1.6, a_min: -2.2, delta: 4.0 })
        },
        CarTruth {
            name: "Synthetic(C)".to_owned(),
            length: 4.957,
            initial_gap: 3.1,
            tau_p: 0.1,
            tau_a: 0.2,
            ..car(Controller::Linear { v_0: 34.0, t_h: 1.1, d_0: 3.0, k_s: 0.25, k_v: 0.7, k_0: 0.6 })
        },
        CarTruth {
            name: "Synthetic(D)".to_owned(),
            length: 4.957,
            initial_gap: 3.4,
            tau_p: 0.3,
            tau_a: 0.1,
            ..car(Controller::Gipps {
                v_0: 34.0,
                t_h: 0.9,
                d_0: 3.0,
                a_max: 2.0,
                a_min: -2.5,
                a_hat_min: -2.7,
                theta: 0.3,
            })
        },
        CarTruth {
            name: "Synthetic(E)".to_owned(),
            length: 4.706,
            initial_gap: 3.0,
            tau_p: 0.2,
            tau_a: 0.3,
            // Middle of Table 3's bounds for the Tesla Model 3, in SI units, with 250 kg on board.
            load: Some(RoadLoad { m_f: 2230.0, phi_f: 1.035, f_0: 205.7, f_1: 0.0, f_2: 0.363 }),
            ..car(Controller::Idm { v_0: 38.0, t_h: 0.9, d_0: 2.8, a_max: 1.8, a_min: -2.0, delta: 4.0 })
        },
    ]
}
