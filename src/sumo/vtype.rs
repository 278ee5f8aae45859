//! From parameters to the attributes of a `vType`, and the loss of the mapping.

use super::SumoError;
use crate::catalog::{Constraint, Dynamics, Variant};
use crate::simulate::CalibratedVariant;
use crate::symbols::Symbol;
use std::fmt::Write;

/// A car-following model of SUMO, by its name there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, strum::IntoStaticStr)]
#[strum(const_into_str, serialize_all = "UPPERCASE")]
pub enum Model {
    /// The intelligent driver model: Eqs. 2 and 3, term by term.
    Idm,
    /// The extended intelligent driver model: another model, which has a reaction time.
    Eidm,
    /// Milanes and Shladover: linear in gap and speed difference, Eqs. 6 and 7 within its limits.
    Acc,
    /// Krauss' model of 1998.
    #[strum(serialize = "KraussOrig1")]
    Krauss,
    /// Wiedemann 99.
    W99,
}

impl Model {
    /// `--step-method.ballistic` for models of SUMO with the equations of leadlag: positions by the mean speed of a step, as in Eq. 1. With
    /// it, SUMO's Krauss has another safe speed.
    pub fn ballistic(self) -> &'static str {
        if self == Model::Krauss { "false" } else { "true" }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct VehicleType {
    /// The model that is used.
    pub model: Model,
    /// Attributes in the order in which they are written, with their values in SUMO's units (m, s).
    pub attributes: Vec<(&'static str, String)>,
    /// Parts of the variant that the type lacks, one sentence each.
    pub lost: Vec<String>,
    /// Additional effects of the type, one sentence each.
    pub added: Vec<String>,
}

/// Largest accelerations of a type without limits \[m/s²\]: the bounds of Eq. 13, paper, Section 2.2.2.
const UPPER: f64 = 5.0;
const LOWER: f64 = 7.0;
/// Hardest braking of SUMO \[m/s²\]; its default for cars.
const EMERGENCY: f64 = 9.0;
/// SUMO's step, if none is given \[s\].
const DEFAULT_STEP_S: f64 = 1.0;
/// `collisionAvoidanceOverride` of ACC \[m/s\]: so large that its safe speed never replaces the control law.
const NEVER: f64 = 1000.0;

/// The vehicle type nearest to a calibrated variant. Fails if SUMO has no such model.
pub fn export(calibrated: &CalibratedVariant, asked: Option<Model>) -> Result<VehicleType, SumoError> {
    let variant = &calibrated.variant;
    let base = variant.base.name;
    let wrong = |asked: Model, possible| Err(SumoError::WrongModel { asked: asked.into_str(), base, possible });
    let refused = |why| Err(SumoError::NoCounterpart { base, why });
    let mut vtype = match (base, asked) {
        ("idm", None | Some(Model::Idm)) => idm(calibrated, Model::Idm),
        ("idm", Some(Model::Eidm)) => idm(calibrated, Model::Eidm),
        ("idm", Some(other)) => return wrong(other, "IDM or EIDM"),
        ("l-cth" | "acc_milanes", None | Some(Model::Acc)) => acc(calibrated),
        ("l-cth" | "acc_milanes", Some(other)) => return wrong(other, "ACC"),
        ("krauss", None | Some(Model::Krauss)) => krauss(calibrated),
        ("krauss", Some(other)) => return wrong(other, "KraussOrig1"),
        ("w99", None | Some(Model::W99)) => w99(calibrated),
        ("w99", Some(other)) => return wrong(other, "W99"),
        ("gipps", _) => {
            return refused(
                "its Krauss model descends from Gipps', but has no theta, no speed-dependent acceleration and no a_hat_min",
            );
        }
        ("l-idm" | "l-gipps", _) => {
            return refused("its ACC has a constant time headway, no other spacing policy");
        }
        _ => return refused("no counterpart is known"),
    };
    vtype.lost.extend(lost(variant, calibrated, vtype.model));
    let v_0 = calibrated.parameters.get(Symbol::v_0);
    vtype.added.push(format!(
        "SUMO drives at the limit of the lane times speedFactor if that is less than maxSpeed: v_0 = {v_0} m/s needs lanes with a limit of at \
         least that, or a larger speedFactor; below it the gap at a speed near the limit is larger than calibrated"
    ));
    Ok(vtype)
}

/// The attributes that every model has, with its largest acceleration, its comfortable and its hardest braking \[m/s²\], and one of its own.
fn common(
    calibrated: &CalibratedVariant,
    model: Model,
    [accel, decel, emergency]: [f64; 3],
    own: Option<(&'static str, String)>,
) -> VehicleType {
    let p = |symbol: Symbol| calibrated.parameters.get(symbol).to_string();
    let mut attributes = vec![
        ("carFollowModel", model.into_str().to_owned()),
        ("accel", accel.to_string()),
        ("decel", decel.to_string()),
        ("emergencyDecel", emergency.to_string()),
    ];
    attributes.extend((model != Model::W99).then(|| ("tau", p(Symbol::t_h))));
    attributes.push(("minGap", p(Symbol::d_0)));
    attributes.extend(own);
    attributes.extend([("maxSpeed", p(Symbol::v_0)), ("speedFactor", "1".to_owned()), ("speedDev", "0".to_owned())]);
    VehicleType { model, attributes, lost: Vec::new(), added: Vec::new() }
}

/// The limits of a model with the parameters of the IDM.
fn limits(calibrated: &CalibratedVariant) -> [f64; 3] {
    let decel = -calibrated.parameters.get(Symbol::a_min);
    [calibrated.parameters.get(Symbol::a_max), decel, decel.max(EMERGENCY)]
}

fn idm(calibrated: &CalibratedVariant, model: Model) -> VehicleType {
    let p = |symbol: Symbol| calibrated.parameters.get(symbol).to_string();
    let limits = limits(calibrated);
    let mut vtype = common(calibrated, model, limits, Some(("delta", p(Symbol::delta))));
    vtype.added.push(format!("braking is limited to {} m/s2", limits[2]));
    if model == Model::Eidm {
        // Its noise off, its jerk limit ineffective; the rest is the improved IDM with a reaction time.
        for name in ["sigmaleader", "sigmagap", "sigmaerror", "ccoolness"] {
            vtype.attributes.push((name, "0".to_owned()));
        }
        vtype.attributes.push(("jerkmax", "100".to_owned()));
        let reaction = if calibrated.variant.delay { p(Symbol::tau_p) } else { "0".to_owned() };
        vtype.attributes.push(("treaction", reaction));
        vtype.added.push("EIDM is the improved IDM with a drive-off term: another equation, whose parameters only have the same names".to_owned());
    }
    vtype
}

fn acc(calibrated: &CalibratedVariant) -> VehicleType {
    let p = |symbol: Symbol| calibrated.parameters.get(symbol);
    let (k_s, k_v) = (p(Symbol::k_s).to_string(), p(Symbol::k_v).to_string());
    let mut vtype = common(calibrated, Model::Acc, [UPPER, LOWER, EMERGENCY], None);
    // Speed minus desired speed is multiplied by it, so it is negative.
    vtype.attributes.push(("speedControlGain", (-p(Symbol::k_0)).to_string()));
    // The same law in all three of its modes, because Eq. 6 has only one.
    for name in ["gapControlGainSpace", "gapClosingControlGainSpace", "collisionAvoidanceGainSpace"] {
        vtype.attributes.push((name, k_s.clone()));
    }
    for name in ["gapControlGainSpeed", "gapClosingControlGainSpeed", "collisionAvoidanceGainSpeed"] {
        vtype.attributes.push((name, k_v.clone()));
    }
    vtype.attributes.push(("collisionAvoidanceOverride", NEVER.to_string()));
    vtype.added.push(format!("acceleration is limited to {UPPER}, braking to {EMERGENCY} m/s2"));
    let further: &[&str] = match calibrated.variant.law() {
        Some(_) => &["the speed never exceeds v_0"],
        None => &[
            "the desired spacing has an additional margin of clamp(75/v - 5, 0, 2) m: 2 m below 10.7 m/s, none above 15 m/s",
            "the law for the speed is used beyond a gap of 120 m instead of whenever it gives less acceleration (Eq. 6), and the \
             speed never exceeds v_0",
        ],
    };
    vtype.added.extend(further.iter().map(|sentence| (*sentence).to_owned()));
    vtype
}

fn krauss(calibrated: &CalibratedVariant) -> VehicleType {
    let limits = limits(calibrated);
    let added = vec![
        "positions use the new speed of a step, which is SUMO's default: with the ballistic update it has another safe speed"
            .to_owned(),
        format!("braking is limited to {} m/s2", limits[2]),
    ];
    VehicleType { added, ..common(calibrated, Model::Krauss, limits, Some(("sigma", "0".to_owned()))) }
}

/// The parameters of W99 that belong to its law, in the order of its file.
const CC: [&str; 9] = ["cc1", "cc2", "cc3", "cc4", "cc5", "cc6", "cc7", "cc8", "cc9"];

fn w99(calibrated: &CalibratedVariant) -> VehicleType {
    let own = calibrated.variant.law().into_iter().flat_map(|law| law.own_parameters());
    let values: Vec<f64> = own.map(|symbol| calibrated.parameters.get(symbol)).collect();
    let mut vtype = common(calibrated, Model::W99, [values[7], EMERGENCY, EMERGENCY], None);
    vtype.attributes.extend(CC.into_iter().zip(values.iter().map(ToString::to_string)));
    vtype.added.push("SUMO draws random numbers; the law uses their means".to_owned());
    vtype
}

/// Parts that no model of SUMO has.
fn lost(variant: &Variant, calibrated: &CalibratedVariant, model: Model) -> Vec<String> {
    let p = |symbol: Symbol| calibrated.parameters.get(symbol);
    let mut lost = Vec::new();
    if variant.delay && model != Model::Eidm {
        lost.push(format!("the perception delay, tau_p = {:.4} s", p(Symbol::tau_p)));
    }
    if variant.delay && model == Model::Eidm {
        lost.push(format!(
            "the perception delay, tau_p = {:.4} s, became treaction: the time between two decisions, not a delay",
            p(Symbol::tau_p)
        ));
    }
    match variant.dynamics {
        Dynamics::None => {}
        Dynamics::Linear => lost.push(format!("the actuation lag, tau_a = {:.4} s", p(Symbol::tau_a))),
        Dynamics::Nonlinear => {
            lost.push(format!(
                "the vehicle dynamics: lag tau_a = {:.4} s, mass, road loads and grade",
                p(Symbol::tau_a)
            ));
        }
    }
    match variant.constraint {
        Constraint::Constant if model == Model::Acc => {}
        Constraint::None => {}
        Constraint::Constant => lost.push("the constant bounds on the acceleration".to_owned()),
        Constraint::Mfc => lost.push("the acceleration curves of the vehicle (MFC)".to_owned()),
    }
    lost.extend(variant.causes().map(|extension| format!("the extension {}", extension.name)));
    lost
}

impl VehicleType {
    /// The step of SUMO that the type is meant for, and its behaviour at SUMO's default; `step_s` is that of the calibration.
    pub fn mean_for(&mut self, step_s: f64) {
        let tau = self.attributes.iter().find(|(name, _)| *name == "tau").and_then(|(_, tau)| tau.parse::<f64>().ok());
        let below = match tau {
            Some(tau) if tau < DEFAULT_STEP_S => format!(
                "; tau = {tau:.3} s is below the {DEFAULT_STEP_S} s that SUMO takes by default, at which followers of this type may collide with \
                 the car ahead"
            ),
            _ => format!("; by default SUMO takes {DEFAULT_STEP_S} s, and another update of the positions"),
        };
        self.added.insert(
            0,
            format!(
                "the calibration was made at steps of {step_s} s: run SUMO with --step-length {step_s} --step-method.ballistic {}{below}",
                self.model.ballistic()
            ),
        );
    }

    /// An additional file of SUMO with this one type; `about` gives its origin in a comment.
    pub fn to_xml(&self, id: &str, about: &str) -> String {
        let mut xml = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n".to_owned();
        let _ = writeln!(xml, "<!-- {} -->", comment(about));
        for (what, sentence) in self.sentences() {
            let _ = writeln!(xml, "<!-- {what}: {} -->", comment(sentence));
        }
        let _ = writeln!(xml, "<additional>\n    {}\n</additional>", self.element(id));
        xml
    }

    /// The `vType` element.
    pub(super) fn element(&self, id: &str) -> String {
        let attributes = self.attributes.iter().map(|(name, value)| format!(" {name}=\"{}\"", escaped(value)));
        format!("<vType id=\"{}\"{}/>", escaped(id), attributes.collect::<String>())
    }

    /// Parts of the model that SUMO lacks or adds, with their effect.
    fn sentences(&self) -> impl Iterator<Item = (&'static str, &String)> {
        let lost = self.lost.iter().map(|sentence| ("not exported", sentence));
        lost.chain(self.added.iter().map(|sentence| ("besides", sentence)))
    }
}

/// The types of several drivers, which SUMO selects with equal probability.
#[derive(Debug, Clone, PartialEq)]
pub struct Distribution {
    /// Id and type of each driver.
    pub types: Vec<(String, VehicleType)>,
}

impl Distribution {
    /// Sentences about all types: missing parts and additional effects.
    pub fn common(&self) -> Vec<(&'static str, &String)> {
        let first = self.types.iter().take(1).flat_map(|(_, vtype)| vtype.sentences());
        first
            .filter(|sentence| self.types.iter().all(|(_, vtype)| vtype.sentences().any(|own| own == *sentence)))
            .collect()
    }

    /// An additional file of SUMO with a `vTypeDistribution` of this id; `about` gives its origin in a comment.
    pub fn to_xml(&self, id: &str, about: &str) -> String {
        let mut xml = format!("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<!-- {} -->\n", comment(about));
        let common = self.common();
        for (what, sentence) in &common {
            let _ = writeln!(xml, "<!-- {what}: {} -->", comment(sentence));
        }
        let _ = writeln!(xml, "<additional>\n    <vTypeDistribution id=\"{}\">", escaped(id));
        for (own, vtype) in &self.types {
            for (what, sentence) in vtype.sentences().filter(|sentence| !common.contains(sentence)) {
                let _ = writeln!(xml, "        <!-- {what}: {} -->", comment(sentence));
            }
            let element = vtype.element(own).replace("/>", " probability=\"1\"/>");
            let _ = writeln!(xml, "        {element}");
        }
        xml + "    </vTypeDistribution>\n</additional>\n"
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}

/// Two hyphens would end a comment, so flags lose theirs.
fn comment(text: &str) -> String {
    let text = text.replace(" --", " ");
    // Twice, because three of them occur two more times.
    text.replace("--", "- -").replace("--", "- -")
}
