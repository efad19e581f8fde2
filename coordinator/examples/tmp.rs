use runout::picture::{self, axes::*, chart::*, soil::*};
fn main() {
    let (mut x, mut y, mut v) = (vec![], vec![], vec![]);
    let mut k = 0u64;
    for i in 0..172 {
        for j in 0..75 {
            let (px, py) = (-34.4 + 0.1 + 0.2 * i as f64, 0.1 + 0.2 * j as f64);
            if py < -px {
                k = k.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                let r = (k >> 33) as f64 / 2f64.powi(31);
                let d = 9.0 * ((px + 22.0) / 22.0).max(0.0) * (1.0 - 0.4 * (py / 15.0)) + 0.03 * r;
                x.push(px + d);
                y.push((py * (1.0 - 0.04 * d)).max(0.1));
                v.push(d);
            }
        }
    }
    let p = SoilPicture {
        title: "Elkhorn River, realisation 17: runout 9.03 m".into(),
        subtitle: "displacement of every material point at rest, 6.2 s after failure; dashed: ground before"
            .into(),
        ground: vec![(-34.4, 15.0), (-15.0, 15.0), (0.0, 0.0), (12.0, 0.0)],
        base_m: 0.0,
        point_size_m: 0.2,
        panels: vec![Panel {
            label: "displacement (m)".into(),
            x: &x,
            y: &y,
            range: range(&v, true),
            values: v.clone(),
            gradient: colorous::VIRIDIS,
        }],
    };
    std::fs::write("/tmp/slide.png", picture::png(&p).unwrap()).unwrap();
    let c = Chart {
        x: Axis::linear("runout (m)", 0.0, 15.0),
        y: Axis::logarithmic("probability of exceedance", 1e-3, 1.0).percent(),
        legend_right: true,
        series: vec![
            Series::new(
                Layer::Band(
                    (0..100)
                        .map(|i| {
                            let x = i as f64 * 0.12;
                            (x, (-x / 2.0).exp() * 0.8, (-x / 2.0f64).exp() * 1.1)
                        })
                        .collect(),
                ),
                SERIES[0],
                "95 % interval",
            ),
            Series::new(
                Layer::Line(
                    (0..100)
                        .map(|i| {
                            let x = i as f64 * 0.12;
                            (x, (-x / 2.0).exp())
                        })
                        .collect(),
                ),
                SERIES[1],
                "weibull",
            ),
            Series::new(
                Layer::Dashed(
                    (0..100)
                        .map(|i| {
                            let x = i as f64 * 0.12;
                            (x, (-x / 3.0).exp())
                        })
                        .collect(),
                ),
                SERIES[2],
                "lognormal",
            ),
        ],
    };
    std::fs::write("/tmp/chart.svg", picture::svg(&c).unwrap()).unwrap();
    std::fs::write("/tmp/chart.png", picture::png(&c).unwrap()).unwrap();
}
