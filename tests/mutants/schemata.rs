//! Puts every mutant into a source file at once, each behind `crate::mutant_switch::on(id)`.

use super::Mutant;
use quote::{ToTokens, quote};
use std::collections::BTreeSet;
use syn::spanned::Spanned;
use syn::visit_mut::{self, VisitMut};
use syn::{BinOp, Expr, ExprMethodCall, Item, Lit, UnOp, parse_quote};

/// The environment variable that names the mutant to switch on.
pub const SWITCH: &str = "LEADLAG_MUTANT";

/// Constants that other files use cannot become functions; they stay unchanged, and so do lists of names.
fn private(constant: &syn::ItemConst) -> bool {
    matches!(constant.vis, syn::Visibility::Inherited) && !matches!(*constant.ty, syn::Type::Reference(_))
}

/// The file with its mutants; they are added to `mutants`.
pub fn instrument(file: &str, text: &str, mutants: &mut Vec<Mutant>) -> String {
    let mut syntax = syn::parse_file(text).unwrap_or_else(|e| panic!("src/models/{file}: {e}"));
    // Unit tests judge and are not judged.
    let is_test = |attribute: &syn::Attribute| attribute.to_token_stream().to_string().contains("cfg (test)");
    syntax.items.retain(|item| !matches!(item, Item::Mod(module) if module.attrs.iter().any(is_test)));
    let constants = syntax.items.iter().filter_map(|item| match item {
        Item::Const(c) if private(c) => Some(c.ident.to_string()),
        _ => None,
    });
    let mut mutator = Mutator { file, lines: text.lines().collect(), constants: constants.collect(), mutants };
    mutator.visit_file_mut(&mut syntax);
    for item in &mut syntax.items {
        // A constant cannot read the environment, so it becomes a function, and its uses become calls.
        if let Item::Const(c) = item
            && private(c)
        {
            let (name, ty, expr) = (&c.ident, &c.ty, &c.expr);
            *item = parse_quote! { fn #name() -> #ty { #expr } };
        }
    }
    // One item per line: enough to find an error of the compiler in the copy.
    syntax.attrs.clear();
    syntax.items.iter().map(|item| item.to_token_stream().to_string() + "\n").collect()
}

struct Mutator<'a> {
    file: &'a str,
    lines: Vec<&'a str>,
    constants: BTreeSet<String>,
    mutants: &'a mut Vec<Mutant>,
}

impl Mutator<'_> {
    fn mutant(&mut self, place: proc_macro2::Span, change: &str) -> usize {
        let (id, at) = (self.mutants.len() + 1, place.start());
        let same =
            |m: &&Mutant| m.file == self.file && m.line == at.line && m.change.split(" (").next() == Some(change);
        let change = match self.mutants.iter().filter(same).count() {
            0 => change.to_owned(),
            before => format!("{change} ({})", before + 1),
        };
        self.mutants.push(Mutant {
            file: self.file.to_owned(),
            line: at.line,
            column: at.column + 1,
            source: self.lines[at.line - 1].trim().to_owned(),
            change,
            made: id,
        });
        id
    }

    fn literal(&mut self, lit: &Lit) -> Option<Expr> {
        let span = lit.span();
        Some(match lit {
            Lit::Float(float) => {
                let value: f64 = float.base10_parse().expect("a float literal is a number");
                let digits = syn::LitFloat::new(&format!("{}_f64", float.base10_digits()), span);
                if value == 0.0 {
                    let id = self.mutant(span, &format!("{float} -> 0.01"));
                    parse_quote! { (if crate::mutant_switch::on(#id) { 0.01_f64 } else { #digits }) }
                } else {
                    let id = self.mutant(span, &format!("{float} -> {float} * 1.01"));
                    parse_quote! { (if crate::mutant_switch::on(#id) { #digits * 1.01 } else { #digits }) }
                }
            }
            Lit::Int(int) => {
                let id = self.mutant(span, &format!("{int} -> {int} + 1"));
                parse_quote! { (if crate::mutant_switch::on(#id) { #int + 1 } else { #int }) }
            }
            Lit::Bool(flag) => {
                let (was, not) = (flag.value, !flag.value);
                let id = self.mutant(span, &format!("{was} -> {not}"));
                parse_quote! { (if crate::mutant_switch::on(#id) { #not } else { #was }) }
            }
            _ => return None,
        })
    }

    /// Arithmetic and comparisons, operands evaluated once.
    fn binary(&mut self, left: &Expr, op: BinOp, right: &Expr) -> Option<Expr> {
        let others: &[BinOp] = match op {
            BinOp::Add(_) => &[parse_quote!(-)],
            BinOp::Sub(_) => &[parse_quote!(+)],
            BinOp::Mul(_) => &[parse_quote!(/)],
            BinOp::Div(_) => &[parse_quote!(*)],
            BinOp::AddAssign(_) => &[parse_quote!(-=)],
            BinOp::SubAssign(_) => &[parse_quote!(+=)],
            BinOp::Lt(_) => &[parse_quote!(<=), parse_quote!(>)],
            BinOp::Le(_) => &[parse_quote!(<), parse_quote!(>)],
            BinOp::Gt(_) => &[parse_quote!(>=), parse_quote!(<)],
            BinOp::Ge(_) => &[parse_quote!(>), parse_quote!(<)],
            BinOp::Eq(_) => &[parse_quote!(!=)],
            BinOp::Ne(_) => &[parse_quote!(==)],
            BinOp::And(_) => &[parse_quote!(||)],
            BinOp::Or(_) => &[parse_quote!(&&)],
            _ => return None,
        };
        let shown = |op: &BinOp| op.to_token_stream().to_string();
        let changes: Vec<(usize, &BinOp)> = others
            .iter()
            .map(|other| (self.mutant(op.span(), &format!("{} -> {}", shown(&op), shown(other))), other))
            .collect();
        let choose = |l: proc_macro2::TokenStream, r: proc_macro2::TokenStream| {
            let arms =
                changes.iter().map(|(id, other)| quote! { if crate::mutant_switch::on(#id) { #l #other #r } else });
            quote! { #(#arms)* { #l #op #r } }
        };
        Some(match op {
            BinOp::And(_) | BinOp::Or(_) => {
                let chosen = choose(quote!((#left)), quote!((#right)));
                parse_quote! { (#chosen) }
            }
            BinOp::AddAssign(_) | BinOp::SubAssign(_) => {
                let chosen = choose(quote!(#left), quote!(__r));
                parse_quote! { ({ let __r = #right; #chosen }) }
            }
            BinOp::Add(_) | BinOp::Sub(_) | BinOp::Mul(_) | BinOp::Div(_) => {
                let chosen = choose(quote!(__l), quote!(__r));
                parse_quote! { (match (#left, #right) { (__l, __r) => #chosen }) }
            }
            _ => {
                let chosen = choose(quote!(__l), quote!(__r));
                parse_quote! { (match (&(#left), &(#right)) { (__l, __r) => #chosen }) }
            }
        })
    }

    fn method(&mut self, call: &ExprMethodCall) -> Option<Expr> {
        let (receiver, name, arguments) = (&call.receiver, call.method.to_string(), &call.args);
        let span = call.method.span();
        Some(match (name.as_str(), arguments.len()) {
            ("min" | "max", 1) => {
                let other = if name == "min" { "max" } else { "min" };
                let id = self.mutant(span, &format!("{name} -> {other}"));
                let (was, other, argument) = (&call.method, syn::Ident::new(other, span), &arguments[0]);
                parse_quote! { (match (#receiver, #argument) {
                    (__l, __r) => if crate::mutant_switch::on(#id) { __l.#other(__r) } else { __l.#was(__r) }
                }) }
            }
            ("clamp", 2) => {
                let lower_only = self.mutant(span, "clamp -> lower bound only");
                let upper_only = self.mutant(span, "clamp -> upper bound only");
                let (lower, upper) = (&arguments[0], &arguments[1]);
                parse_quote! { (match (#receiver, #lower, #upper) {
                    (__x, __l, __u) => if crate::mutant_switch::on(#lower_only) { __x.max(__l) }
                        else if crate::mutant_switch::on(#upper_only) { __x.min(__u) } else { __x.clamp(__l, __u) }
                }) }
            }
            ("sqrt", 0) => {
                let id = self.mutant(span, "sqrt -> left out");
                parse_quote! { (match #receiver {
                    __x => if crate::mutant_switch::on(#id) { __x } else { __x.sqrt() }
                }) }
            }
            ("floor", 0) => {
                let id = self.mutant(span, "floor -> ceil");
                parse_quote! { (match #receiver {
                    __x => if crate::mutant_switch::on(#id) { __x.ceil() } else { __x.floor() }
                }) }
            }
            _ => return None,
        })
    }

    fn condition(&mut self, condition: &mut Expr) {
        // Comparisons and their negations have separate mutants.
        if matches!(condition, Expr::Let(_) | Expr::Paren(_)) {
            return;
        }
        let id = self.mutant(condition.span(), "condition -> negated");
        *condition =
            parse_quote! { (match #condition { __c => if crate::mutant_switch::on(#id) { !__c } else { __c } }) };
    }
}

impl VisitMut for Mutator<'_> {
    fn visit_expr_mut(&mut self, expr: &mut Expr) {
        if let Expr::Repeat(repeat) = expr {
            return self.visit_expr_mut(&mut repeat.expr); // the length of an array cannot be switched
        }
        visit_mut::visit_expr_mut(self, expr);
        let replaced = match expr {
            Expr::Lit(literal) => self.literal(&literal.lit),
            Expr::Binary(b) => self.binary(&b.left, b.op, &b.right),
            Expr::MethodCall(call) => self.method(call),
            Expr::Unary(unary) if matches!(unary.op, UnOp::Neg(_)) => {
                let (id, operand) = (self.mutant(unary.op.span(), "- -> left out"), &unary.expr);
                Some(
                    parse_quote! { (match #operand { __x => if crate::mutant_switch::on(#id) { __x } else { -__x } }) },
                )
            }
            Expr::Path(path) => {
                let constant = path.path.get_ident().filter(|name| self.constants.contains(&name.to_string()));
                constant.map(|name| parse_quote! { #name() })
            }
            Expr::If(branch) => {
                self.condition(&mut branch.cond);
                None
            }
            _ => None,
        };
        if let Some(replaced) = replaced {
            *expr = replaced;
        }
    }

    fn visit_item_const_mut(&mut self, constant: &mut syn::ItemConst) {
        if private(constant) {
            visit_mut::visit_item_const_mut(self, constant);
        }
    }

    // Nothing in discriminants, associated constants, attributes, types and patterns can be switched at run time.
    fn visit_variant_mut(&mut self, _: &mut syn::Variant) {}
    fn visit_impl_item_const_mut(&mut self, _: &mut syn::ImplItemConst) {}
    fn visit_attribute_mut(&mut self, _: &mut syn::Attribute) {}
    fn visit_type_mut(&mut self, _: &mut syn::Type) {}
    fn visit_pat_mut(&mut self, _: &mut syn::Pat) {}
}
