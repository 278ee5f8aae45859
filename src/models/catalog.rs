//! The part table and the ninety variants of the paper's Table 1.
//!
//! A part is one file of one folder (`src/models/reference/<folder>/<part>.rs`); a row here names it and the parameters that it reads. The
//! tables are macros because two places need the rows: the enums below, and the reference evaluator, which declares its modules and selects
//! its functions from the same rows. To add a part or a law, add its row and its file.

use crate::extension::{Extension, ExtensionConflict, Extensions};
use crate::symbols::{EXTENSION_PARAMETERS, Symbol};
use crate::text::spelling::{nearest, suggestion};
use std::fmt;

/// Rows of the folder `controller`: type name, file name, paper, parameters read.
macro_rules! controller_parts {
    ($use:ident) => {
        $use! {
            Controller, "a controller: from perceived signals to the commanded acceleration";
            Idm, idm, "Eq. 2", [delta, v_0, a_max];
            Gipps, gipps, "Eqs. 4 and 5", [theta, v_0, d_0, t_h, a_max, a_min, a_hat_min];
            Linear, linear, "Eq. 6", [k_s, k_v, k_0, v_0];
            Law, law, "none: a separate law, in one WGSL file", [];
        }
    };
}

/// Rows of the folder `spacing`.
macro_rules! spacing_parts {
    ($use:ident) => {
        $use! {
            Spacing, "a spacing policy: the spacing that a controller aims at";
            IdmDesired, idm_desired, "Eq. 3", [d_0, t_h, a_max, a_min];
            Cth, cth, "Eq. 7", [d_0, t_h];
            GippsEquilibrium, gipps_equilibrium, "Eq. 8", [theta, d_0, t_h, a_min, a_hat_min];
            Inherent, inherent, "none: the controller needs no policy", [];
        }
    };
}

/// Rows of the folder `dynamics`.
macro_rules! dynamics_parts {
    ($use:ident) => {
        $use! {
            Dynamics, "vehicle dynamics: from the commanded to the actual acceleration";
            None, none, "Eq. 9", [];
            Linear, linear, "Eq. 10", [tau_a];
            Nonlinear, nonlinear, "Eq. 11", [tau_a, m_load, f_0, f_1, f_2];
        }
    };
}

/// Rows of the folder `constraint`.
macro_rules! constraint_parts {
    ($use:ident) => {
        $use! {
            Constraint, "an acceleration constraint";
            None, none, "Eq. 12", [];
            Constant, constant, "Eq. 13", [];
            Mfc, mfc, "Eq. 14", [];
        }
    };
}

/// The laws outside the paper: the names of their files in `shaders/law` and `src/models/reference/law`.
macro_rules! law_files {
    ($use:ident) => {
        $use! {
            ovm,
            fvdm,
            iidm,
            acc_kesting,
            krauss,
            newell,
            helly,
            acc_milanes,
            w99,
        }
    };
}

pub(crate) use {constraint_parts, controller_parts, dynamics_parts, law_files, spacing_parts};

macro_rules! part_enum {
    ($folder:ident, $doc:literal; $($part:ident, $file:ident, $paper:literal, [$($symbol:ident),*];)*) => {
        #[doc = concat!("Folder of parts: ", $doc, ".")]
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum $folder {
            $(#[doc = $paper] $part,)*
        }

        impl $folder {
            /// All parts of the folder, in table order.
            pub const ALL: &'static [$folder] = &[$($folder::$part),*];

            /// File name of the part, without extension.
            pub fn name(self) -> &'static str {
                match self { $($folder::$part => stringify!($file)),* }
            }

            /// The parameters it reads.
            pub fn parameters(self) -> &'static [Symbol] {
                match self { $($folder::$part => &[$(Symbol::$symbol),*]),* }
            }
        }
    };
}

controller_parts!(part_enum);
spacing_parts!(part_enum);
dynamics_parts!(part_enum);
constraint_parts!(part_enum);

/// A base model: a controller with its spacing policy, or a law.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Base {
    /// `idm`, `gipps`, `l-cth`, `l-idm`, `l-gipps`, or the name of a law.
    pub name: &'static str,
    /// The paper's spelling; the name of a law.
    pub paper: &'static str,
    pub controller: Controller,
    /// Its spacing policy.
    pub spacing: Spacing,
}

/// The base models; only these pairs exist. The five of Table 1 come first, in its order, and others follow, so that the ids of Table 1
/// stay.
pub const BASES: &[Base] = &[
    Base { name: "idm", paper: "IDM", controller: Controller::Idm, spacing: Spacing::IdmDesired },
    Base { name: "gipps", paper: "Gipps", controller: Controller::Gipps, spacing: Spacing::Inherent },
    Base { name: "l-cth", paper: "L-CTH", controller: Controller::Linear, spacing: Spacing::Cth },
    Base { name: "l-idm", paper: "L-IDM", controller: Controller::Linear, spacing: Spacing::IdmDesired },
    Base { name: "l-gipps", paper: "L-Gipps", controller: Controller::Linear, spacing: Spacing::GippsEquilibrium },
];

impl Base {
    /// The base model of a law.
    pub fn of_law(law: &'static Extension) -> Base {
        Base { name: &law.name, paper: &law.name, controller: Controller::Law, spacing: Spacing::Inherent }
    }
}

/// One of the ninety model variants of Table 1, or of those of a further base model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Variant {
    /// The base model.
    pub base: Base,
    /// Perception delay, Eqs. 15 (no) and 16 (yes).
    pub delay: bool,
    /// Vehicle dynamics.
    pub dynamics: Dynamics,
    /// Acceleration constraint.
    pub constraint: Constraint,
    /// Parts beyond the ninety; the law comes first if the base model is one.
    pub extensions: Extensions,
}

/// No variant has this id or name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum UnknownVariant {
    #[error(
        "variant {0}: expected an id from 1 to {count} (1 to 90 are the paper's Table 1); `leadlag list variants` shows them",
        count = Variant::COUNT
    )]
    Id(u32),
    #[error(
        "variant `{name}`: `{word}` is not a part; expected BASE[+delay][+linear|+nonlinear][+constant|+mfc] \
         with BASE one of {}, a law of `leadlag list laws`, or FILE.wgsl{}",
        BASES.iter().map(|b| b.name).collect::<Vec<_>>().join(", "),
        suggestion(*nearest)
    )]
    Word { name: String, word: String, nearest: Option<&'static str> },
    #[error(
        "variant `{name}`: `{part}` is a part of a variant, and the base model before it is missing; expected \
         BASE[+delay][+linear|+nonlinear][+constant|+mfc] with BASE one of {}, such as `idm+{part}`",
        BASES.iter().map(|b| b.name).collect::<Vec<_>>().join(", ")
    )]
    NoBase { name: String, part: String },
    #[error("variant `{name}`: `{word}` contradicts an earlier part of the name")]
    Twice { name: String, word: String },
}

impl Variant {
    /// Variants of one base: with and without delay, three dynamics, three constraints.
    const PER_BASE: usize = 18;

    /// Number of variants: the ninety of Table 1, unless there are further base models.
    pub const COUNT: u32 = (BASES.len() * Self::PER_BASE) as u32;

    /// The variant with an id: 1 to 90 are those of Table 1.
    pub fn from_id(id: u32) -> Result<Variant, UnknownVariant> {
        if !(1..=Self::COUNT).contains(&id) {
            return Err(UnknownVariant::Id(id));
        }
        // Table 1: constraints vary fastest, then dynamics, delay, base.
        let k = (id - 1) as usize;
        Ok(Variant {
            base: BASES[k / Self::PER_BASE],
            delay: (k / 9) % 2 == 1,
            dynamics: Dynamics::ALL[(k / 3) % 3],
            constraint: Constraint::ALL[k % 3],
            extensions: Extensions::NONE,
        })
    }

    /// All, in the order of Table 1.
    pub fn all() -> impl Iterator<Item = Variant> {
        (1..=Self::COUNT).map(|id| Variant::from_id(id).expect("ids up to COUNT exist"))
    }

    /// The id; that of Table 1 from 1 to 90, and 0 for a law. Extensions do not change it.
    pub fn id(&self) -> u32 {
        let Some(base) = BASES.iter().position(|b| *b == self.base) else { return 0 };
        let position = |found: Option<usize>| found.expect("a variant is made of catalogued parts");
        let dynamics = position(Dynamics::ALL.iter().position(|d| *d == self.dynamics));
        let constraint = position(Constraint::ALL.iter().position(|c| *c == self.constraint));
        (base * Self::PER_BASE + usize::from(self.delay) * 9 + dynamics * 3 + constraint) as u32 + 1
    }

    /// The id as text; a dash for a law.
    pub fn shown_id(&self) -> String {
        match self.id() {
            0 => "–".to_owned(),
            id => id.to_string(),
        }
    }

    /// The name, such as `gipps+delay+linear+mfc`; parts that are absent are not named, extensions come last.
    pub fn name(&self) -> String {
        let mut name = self.base.name.to_owned();
        if self.delay {
            name += "+delay";
        }
        for (absent, part) in [
            (self.dynamics == Dynamics::None, self.dynamics.name()),
            (self.constraint == Constraint::None, self.constraint.name()),
        ] {
            if !absent {
                name.push('+');
                name += part;
            }
        }
        for extension in self.causes() {
            name.push('+');
            name += &extension.name;
        }
        name
    }

    /// A law with nothing else.
    pub fn of_law(law: &'static Extension) -> Variant {
        Variant { extensions: Extensions::NONE.with(law), ..Variant::of_base(Base::of_law(law)) }
    }

    /// The law, if the base model is one.
    pub fn law(&self) -> Option<&'static Extension> {
        self.extensions.list().first().copied().filter(|first| first.is_law())
    }

    /// The extensions, without the law.
    pub fn causes(&self) -> impl Iterator<Item = &'static Extension> {
        self.extensions.list().iter().copied().filter(|extension| !extension.is_law())
    }

    /// True for a parameter of the variant without its extensions.
    pub fn is_of_base(&self, symbol: Symbol) -> bool {
        match symbol {
            Symbol::Extension(row) => self.law().is_some_and(|law| law.name == row.extension),
            _ => true,
        }
    }

    /// The same with another extension.
    pub fn with(self, extension: &'static Extension) -> Result<Variant, ExtensionConflict> {
        let name = extension.name.clone();
        if extension.is_law() {
            return Err(ExtensionConflict::Law { name });
        }
        if self.extensions.get(&name).is_some() {
            return Err(ExtensionConflict::Twice { name });
        }
        let taken = self.parameters();
        if let Some(lacking) = extension.model_parameters.iter().find(|symbol| !taken.contains(symbol)) {
            let model = Variant { extensions: Extensions::NONE, ..self }.name();
            return Err(ExtensionConflict::Lacks { name, model, parameter: lacking.name() });
        }
        for parameter in &extension.parameters {
            if let Some(symbol) = taken.iter().find(|s| s.name() == parameter.name()) {
                let other = match symbol {
                    Symbol::Extension(row) => row.extension.clone(),
                    _ => "the base model".to_owned(),
                };
                return Err(ExtensionConflict::Parameter { name, parameter: parameter.name().to_owned(), other });
            }
        }
        if let Some(conflict) = self.extensions.loop_conflict(extension) {
            return Err(conflict);
        }
        let extensions = self.extensions.with(extension);
        let found = extensions.list().iter().map(|e| e.own_parameters().count()).sum();
        if found > EXTENSION_PARAMETERS {
            return Err(ExtensionConflict::Many { name, limit: EXTENSION_PARAMETERS, found });
        }
        Ok(Variant { extensions, ..self })
    }

    /// True if perception may be delayed.
    pub fn perceives_late(&self) -> bool {
        self.delay || self.extensions.delay().is_some()
    }

    /// The calibration parameters (Table 1, last column), in the order of the symbol table.
    pub fn parameters(&self) -> Vec<Symbol> {
        let delay: &[Symbol] = if self.delay { &[Symbol::tau_p] } else { &[] };
        let read = [
            self.base.controller.parameters(),
            self.base.spacing.parameters(),
            delay,
            self.dynamics.parameters(),
            self.constraint.parameters(),
        ];
        let mut symbols: Vec<Symbol> = read.concat();
        let of_law = self.law().map_or(&[][..], |law| &law.parameters);
        symbols.extend(of_law.iter().filter(|symbol| !matches!(symbol, Symbol::Extension(_))));
        symbols.sort_unstable();
        symbols.dedup();
        symbols.extend(self.extensions.list().iter().flat_map(|extension| extension.own_parameters()));
        symbols
    }

    /// True if the follower's mass and inertia are needed.
    pub fn needs_vehicle(&self) -> bool {
        self.dynamics == Dynamics::Nonlinear || self.constraint == Constraint::Mfc
    }

    /// True if the road grade is needed.
    pub fn needs_grade(&self) -> bool {
        self.dynamics == Dynamics::Nonlinear || self.extensions.read("sin_grade")
    }

    /// True if the position on the road is needed.
    pub fn needs_position(&self) -> bool {
        self.needs_grade() || self.extensions.read("x_f")
    }
}

impl fmt::Display for Variant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name())
    }
}

impl Variant {
    /// The variant by a name: an id, or a base model and its parts. Case does not matter. `laws` are base models, too.
    pub fn named(text: &str, laws: &[&'static Extension]) -> Result<Variant, UnknownVariant> {
        let text = text.trim();
        if let Ok(id) = text.parse() {
            return Variant::from_id(id);
        }
        let lower = text.to_ascii_lowercase();
        let mut words = lower.split('+').map(str::trim);
        let unknown = |word: &str, nearest: Option<&'static str>| UnknownVariant::Word {
            name: text.to_owned(),
            word: word.to_owned(),
            nearest,
        };
        let first = words.next().unwrap_or_default();
        let base = BASES.iter().copied().find(|b| b.name == first);
        let of_law = || laws.iter().find(|law| law.name == first).map(|law| Variant::of_law(law));
        let bare = base.map(Variant::of_base).or_else(of_law);
        let mut variant = bare.ok_or_else(|| match PARTS.contains(&first) {
            true => UnknownVariant::NoBase { name: text.to_owned(), part: first.to_owned() },
            false => unknown(first, nearest_base(first, laws)),
        })?;
        for word in words {
            let twice = match word {
                "delay" => std::mem::replace(&mut variant.delay, true),
                "linear" => std::mem::replace(&mut variant.dynamics, Dynamics::Linear) != Dynamics::None,
                "nonlinear" => std::mem::replace(&mut variant.dynamics, Dynamics::Nonlinear) != Dynamics::None,
                "constant" => std::mem::replace(&mut variant.constraint, Constraint::Constant) != Constraint::None,
                "mfc" => std::mem::replace(&mut variant.constraint, Constraint::Mfc) != Constraint::None,
                _ => return Err(unknown(word, nearest(word, PARTS))),
            };
            if twice {
                return Err(UnknownVariant::Twice { name: text.to_owned(), word: word.to_owned() });
            }
        }
        Ok(variant)
    }

    fn of_base(base: Base) -> Variant {
        let (dynamics, constraint) = (Dynamics::None, Constraint::None);
        Variant { base, delay: false, dynamics, constraint, extensions: Extensions::NONE }
    }
}

/// Suffixes of the base model in a name.
const PARTS: [&str; 5] = ["delay", "linear", "nonlinear", "constant", "mfc"];

/// The base model whose name is similar to a word, or ends with it: `l-cth` for `cth`.
fn nearest_base(word: &str, laws: &[&'static Extension]) -> Option<&'static str> {
    let bases = || BASES.iter().map(|b| b.name).chain(laws.iter().map(|law| law.name.as_str()));
    let ends = |base: &&str| base.rsplit_once('-').is_some_and(|(_, end)| end == word);
    nearest(word, bases()).or_else(|| bases().find(ends))
}
