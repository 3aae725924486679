//! Error maps: their scale, its colours, and the maps of the metrics beside the main one.

use super::comparison::{Images, shown};
use super::context::{SceneView, estimate};
use super::markup::Markup;
use super::numbers::significant;
use super::picture::Picture;
use crate::experiment::results::{MetricInfo, Results};
use crate::film::ScalarImage;
use crate::film::exr::LayeredImage;
use crate::film::false_color::Scale;

/// Maps of the metrics beside the main one are at most so large.
const SIDE: usize = 400;

/// The map of a metric among the layers of an estimator's maps.
pub(super) fn error_map(layers: &LayeredImage, key: &str) -> Option<ScalarImage> {
    let image = layers.layer(key)?;
    let values = image.pixels.iter().map(|p| p[0]).collect();
    Some(ScalarImage { width: image.width, height: image.height, values })
}

/// Top of the maps' scale: as the experiment says, else the largest 99th percentile.
pub(super) fn map_scale<'a>(
    metric: &MetricInfo,
    view: &SceneView,
    maps: impl Iterator<Item = &'a ScalarImage>,
) -> f32 {
    let stated = metric.map_scale.get(&view.scene.key).map(|v| *v as f32);
    stated
        .filter(|v| v.is_finite() && *v > 0.0)
        .unwrap_or_else(|| maps.map(|map| map.quantile(0.99)).fold(0.0, f32::max))
}

/// The scale of the maps under them: its colours with numbers.
pub(super) fn color_bar(m: &mut Markup, metric: &MetricInfo, scale: f32) {
    m.tag("div", &[("class", &"color-bar")], |m| {
        m.leaf("span", &[], format!("{} a pixel, mean over the runs:", metric.label));
        m.leaf("span", &[("class", &"number")], "0");
        if let Some(p) = Picture::of_scale(Scale::Linear(1.0)) {
            p.img(m, "colours of the error maps from the least to the greatest", &[]);
        }
        let top = significant(f64::from(scale), 3);
        m.leaf("span", &[("class", &"number")], format!("≥ {top}"));
        m.leaf(
            "span",
            &[("class", &"quiet")],
            "(linear; the top is the 99th percentile over all estimators of this scene)",
        );
    });
}

/// Maps of the other metrics, folded.
pub(super) fn other_maps(
    results: &Results,
    view: &SceneView,
    images: &Images,
    main: Option<&MetricInfo>,
    m: &mut Markup,
) {
    let Some(main) = main else { return };
    let others: Vec<&MetricInfo> = results
        .metrics
        .iter()
        .filter(|k| k.key != main.key && k.map_scale.contains_key(&view.scene.key))
        .collect();
    if others.is_empty() {
        return;
    }
    m.tag("details", &[], |m| {
        let names: Vec<&str> = others.iter().map(|k| k.label.as_str()).collect();
        m.leaf("summary", &[], format!("Error maps of the other metrics: {}", names.join(", ")));
        for metric in others {
            let scale = metric.map_scale[&view.scene.key] as f32;
            m.leaf("h4", &[], format!("{}, from 0 to {}", metric.label, significant(f64::from(scale), 3)));
            let style = format!("--columns:{}", view.entries.len().max(3));
            m.tag("div", &[("class", &"row"), ("style", &style)], |m| {
                for (entry, maps) in view.entries.iter().zip(&images.maps) {
                    let map = maps.as_ref().and_then(|maps| error_map(maps, &metric.key));
                    let picture = map.and_then(|map| Picture::of_map(&map, Scale::Linear(scale), SIDE));
                    m.tag("figure", &[], |m| {
                        let alt = format!("{} of {}", metric.label, entry.info.label);
                        let exr = entry.cell.files.error_exr.as_deref().unwrap_or_default();
                        shown(m, picture.as_ref(), &alt, exr, &metric.key, view);
                        let value = entry.cell.metric(&metric.key).map_or(String::new(), |v| estimate(&v));
                        m.tag("figcaption", &[], |m| {
                            m.leaf("b", &[], &entry.info.label);
                            m.leaf("span", &[("class", &"fact")], &value);
                        });
                    });
                }
            });
        }
    });
}
