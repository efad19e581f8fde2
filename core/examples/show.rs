use runout_core::validation::{Depth, cases};
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let depth = if a[2] == "full" { Depth::Full } else { Depth::Quick };
    for c in cases().iter().filter(|c| c.name.contains(&a[1])) {
        let t = std::time::Instant::now();
        let f = (c.run)(depth);
        println!("== {} {:.1} s passes {}", c.name, t.elapsed().as_secs_f64(), f.passes());
        for k in &f.checks {
            println!(
                "{} {:90} ref {:10.4} found {:10.5} err {:?} {:?} {}",
                if k.passes() { "ok " } else { "BAD" },
                k.what,
                k.reference,
                k.found,
                k.error().map(|e| (e * 1e5).round() / 1e5),
                k.comparison,
                k.unit
            );
        }
        for n in &f.notes {
            println!("   note: {n}");
        }
        if a.len() > 3 {
            for g in &f.figures {
                println!("  fig {} {} | {} | {}", g.name, g.title, g.x, g.y);
                for s in &g.series {
                    println!("    {} {:?}", s.label, &s.points[..s.points.len().min(40)]);
                }
            }
        }
    }
}
