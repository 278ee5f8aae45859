//! Parameters that an extension or a law declares and uses.

use super::check::ShaderError;
use super::doc;
use super::extension::Reader;
use crate::symbols::{EXTENSION_PARAMETERS, ExtensionParameter, Role, Scale, SearchKind, Symbol};
use naga::Span;

/// Parameters of the paper that a law may read. The others belong to the perception delay and the vehicle dynamics.
const LAWS_MAY_HAVE: [Symbol; 11] = [
    Symbol::delta,
    Symbol::k_s,
    Symbol::k_v,
    Symbol::k_0,
    Symbol::theta,
    Symbol::v_0,
    Symbol::d_0,
    Symbol::t_h,
    Symbol::a_max,
    Symbol::a_min,
    Symbol::a_hat_min,
];

/// A parameter as a file declares it.
pub(super) enum Declared {
    /// One of the paper, by its name; laws only.
    Table(Symbol),
    /// One of its own.
    Own(ExtensionParameter),
}

impl Reader<'_> {
    /// The search method for the cause: by the line of the file, or by its parameters.
    pub(super) fn traits(&self, head: &doc::Head, parameters: &[Declared]) -> Result<(SearchKind, Scale), ShaderError> {
        let own = parameters.iter().filter_map(|declared| match declared {
            Declared::Own(row) => Some(row),
            Declared::Table(_) => None,
        });
        let own: Vec<&ExtensionParameter> = own.collect();
        let by_parameters = match own.iter().filter(|row| row.is_time()).count() {
            0 if own.iter().any(|row| row.unit == "Hz") => SearchKind::Harmonic,
            0 => SearchKind::Size,
            1 => SearchKind::Event,
            _ => SearchKind::Stretch,
        };
        let search = head.search.unwrap_or(by_parameters);
        let expected = match search {
            SearchKind::Limit if !matches!(own[..], [row] if row.neutral == row.upper) => {
                "one parameter, whose neutral value is its upper bound"
            }
            SearchKind::Steps | SearchKind::Integral if !matches!(own[..], [row] if row.neutral.is_finite()) => {
                "one parameter, with a neutral value"
            }
            SearchKind::Limit | SearchKind::Steps | SearchKind::Integral => return Ok((search, head.scale)),
            _ if search == by_parameters => return Ok((search, head.scale)),
            _ => "the parameters that this takes",
        };
        let word: &str = search.into_str();
        Err(self.plain(format!("`//! search: {word}`: expected {expected}")))
    }

    pub(super) fn parameters(&self, is_law: bool) -> Result<Vec<Declared>, ShaderError> {
        let read = |(name, comment, span): (String, String, Span)| {
            if let Some(symbol) = Symbol::from_name(&name) {
                return self.of_the_table(symbol, is_law, &comment, span);
            }
            let about =
                doc::parameter(&comment).map_err(|message| self.source.error_at(span, format!("{name}: {message}")))?;
            let row = ExtensionParameter {
                extension: self.name.to_owned(),
                name,
                unit: about.unit,
                meaning: about.meaning,
                lower: about.lower,
                upper: about.upper,
                neutral: about.neutral,
                role: if about.is_length { Role::Length } else { Role::Value },
                search: SearchKind::default(),
                scale: Scale::default(),
            };
            let is_possible = |bound: &f64| row.domain().contains(*bound);
            if ![row.lower, row.upper].iter().all(is_possible) {
                let (name, lower, upper, most) = (&row.name, row.lower, row.upper, row.domain().most());
                return self.refuse(
                    span,
                    format!("{name}: expected bounds of a size below {most:e}, found {lower:e} to {upper:e}"),
                );
            }
            Ok(Declared::Own(row))
        };
        let members = self.members("Parameters")?;
        if is_law && members.is_empty() {
            return Err(self.plain(
                "a law: expected a `struct Parameters` with at least one parameter, found none; declare the parameters to search",
            ));
        }
        let own = || members.iter().filter(|(name, ..)| Symbol::from_name(name).is_none());
        if let Some((.., span)) = own().nth(EXTENSION_PARAMETERS) {
            let (limit, found) = (EXTENSION_PARAMETERS, own().count());
            return self.refuse(
                *span,
                format!("expected at most {limit} parameters in a file, found {found}; make the others constants"),
            );
        }
        members.into_iter().map(read).collect()
    }

    /// Parameters of the model that the functions read or change. Those of a law are in its own `Parameters`.
    pub(super) fn model_parameters(&self, is_law: bool, declared: &[Declared]) -> Result<Vec<Symbol>, ShaderError> {
        let has = |wanted: Symbol| declared.iter().any(|d| matches!(d, Declared::Table(symbol) if *symbol == wanted));
        let read = |(name, span): (String, Span)| {
            let symbol = Symbol::from_name(&name).expect("this `Params` has the symbols of the table only");
            if is_law && !has(symbol) {
                return self.refuse(
                    span,
                    format!("p.{name}: a law has the parameters of the paper that its `Parameters` declares, and {name} is none of them"),
                );
            }
            Ok(symbol)
        };
        self.members_read("Params").map(read).collect()
    }

    /// A parameter with a name of the paper's.
    fn of_the_table(&self, symbol: Symbol, is_law: bool, comment: &str, span: Span) -> Result<Declared, ShaderError> {
        let name = symbol.name();
        if !is_law {
            return self.refuse(span, format!("{name} is a parameter of the base models; give yours another name"));
        }
        if !LAWS_MAY_HAVE.contains(&symbol) {
            return self.refuse(
                span,
                format!("{name} belongs to the perception delay or the vehicle dynamics, which a variant may add to your law; give yours another name"),
            );
        }
        if comment.contains('[') {
            let unit = symbol.unit();
            return self.refuse(
                span,
                format!("{name} is the paper's parameter: its unit is {unit}, and its bounds are those of `--bounds`; remove its comment, or give yours another name"),
            );
        }
        Ok(Declared::Table(symbol))
    }
}
