//! Fingerprint that distinguishes drives, whatever file they are read from.

use crate::trajectory::Trajectory;
use crate::vehicle::Vehicle;

/// SHA-256 of all numbers that a simulation may read, or that determine its end. Names and paths are not included.
pub(crate) fn fingerprint(trajectory: &Trajectory, vehicle: Option<&Vehicle>) -> String {
    let mut bytes: Vec<u8> = Vec::new();
    let mut add = |values: &[f64]| {
        // Lengths separate neighbouring fields.
        bytes.extend((values.len() as u64).to_le_bytes());
        values.iter().for_each(|x| bytes.extend(x.to_bits().to_le_bytes()));
    };
    // All fields, so that a new signal of trajectories must be hashed, too.
    #[rustfmt::skip]
    let Trajectory {
        label: _, source: _, follower: _, name: _, id: _, notes: _, is_placed: _,
        dt, dt_raw, t, x_l, v_l, len_l, x_f, v_f, s, v_l2, s_l2, grade,
    } = trajectory;
    add(&[*dt, *dt_raw, *len_l]);
    add(&t[..1]);
    [x_l, v_l, x_f, v_f, s].into_iter().for_each(|signal| add(signal));
    [v_l2, s_l2].into_iter().for_each(|signal| add(signal.as_deref().unwrap_or_default()));
    match grade {
        Some(grade) => {
            [&grade.x, &grade.sin].into_iter().chain([&grade.period.into_iter().collect()]).for_each(|x| add(x))
        }
        None => add(&[]),
    }
    if let Some(v) = vehicle {
        add(&[v.m_0, v.phi_f]);
        [v.f_0, v.f_1_printed, v.f_2_printed].iter().for_each(|pair| add(pair));
        match &v.mfc {
            Some(mfc) => [&mfc.v, &mfc.a_ap, &mfc.a_dp].into_iter().for_each(|x| add(x)),
            None => add(&[]),
        }
    }
    super::sha256(&bytes)
}
