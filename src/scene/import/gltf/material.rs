//! Materials: metallic-roughness, transmission and volumes as the nearest of ours.
//!
//! A dielectric base becomes `plastic`, metal a conductor that reflects the base colour without Fresnel's formula, and what
//! lies between a sum of both; α is the square of the roughness. Transmission with a thickness is a dielectric (a solid, with
//! an absorbing medium in it), without one a thin pane.

use super::Translator;
use super::json::{Material, TextureReference};
use crate::error::Result;
use crate::scene::file::assets::Asset;
use crate::scene::import::Place;
use crate::scene::import::numbers::{array, color, number, quoted};
use crate::texture::load::{self, Encoding};

/// What a shape needs of its material.
#[derive(Clone, Debug)]
pub(super) struct Translated {
    pub name: String,
    pub emission: Option<[f64; 3]>,
    pub interior: Option<String>,
    /// Which set of texture coordinates it asks for.
    pub tex_coord: usize,
}

/// The least share of light that is left after the attenuation distance: black would be an infinite coefficient.
const DARKEST: f64 = 1e-6;

impl Translator {
    /// The material of that number, or the default one.
    pub(super) fn material(&mut self, index: Option<usize>) -> Result<Translated> {
        if let Some(known) = self.materials.get(&index) {
            return Ok(known.clone());
        }
        let part = index.map_or("the default material".to_owned(), |i| format!("materials[{i}]"));
        let default = Material::default();
        let materials = std::mem::take(&mut self.data.root.materials);
        let material = index.map_or(Some(&default), |i| materials.get(i));
        let translated = match material {
            Some(material) => self.translate(&part, material),
            None => Err(self.data.error(&part, "there is none")),
        };
        self.data.root.materials = materials;
        let translated = translated?;
        self.materials.insert(index, translated.clone());
        Ok(translated)
    }

    fn translate(&mut self, part: &str, material: &Material) -> Result<Translated> {
        let name = material.name.clone().unwrap_or_else(|| part.to_owned());
        let pbr = &material.pbr_metallic_roughness;
        for (there, what) in [
            (material.normal_texture.is_some(), "the normal map is not looked at"),
            (
                pbr.metallic_roughness_texture.is_some(),
                "the texture of metalness and roughness is not looked at",
            ),
        ] {
            if there {
                self.warn(part, what);
            }
        }
        let share = |x: f64| x.clamp(0.0, 1.0);
        let (metal, roughness) = (share(pbr.metallic_factor), share(pbr.roughness_factor).powi(2));
        let factor = [0, 1, 2].map(|i| pbr.base_color_factor[i]);
        let base = match &pbr.base_color_texture {
            Some(texture) => self.texture(part, texture, factor)?,
            None => color(factor),
        };
        let extensions = &material.extensions;
        let ior = extensions.ior.as_ref().map_or(1.5, |i| i.ior);
        let transmission = extensions.transmission.as_ref();
        if transmission.is_some_and(|t| t.transmission_texture.is_some()) {
            self.warn(part, "the texture of transmission is not looked at");
        }
        let transmission = share(transmission.map_or(0.0, |t| t.transmission_factor)) * (1.0 - metal);
        let volume = extensions.volume.as_ref().filter(|v| v.thickness_factor > 0.0);
        let rough =
            if roughness == 0.0 { String::new() } else { format!(", roughness = {}", number(roughness)) };
        let mut layers = Vec::new();
        if metal > 0.0 {
            layers.push((metal, format!("conductor = {{ reflectance = {base}{rough} }}")));
        }
        if transmission > 0.0 {
            layers.push((
                transmission,
                match volume {
                    // A rough boundary between equal indices has no facets.
                    Some(_) if ior == 1.0 => format!("dielectric = {{ ior = 1.0, transmittance = {base} }}"),
                    Some(_) => {
                        format!("dielectric = {{ ior = {}, transmittance = {base}{rough} }}", number(ior))
                    }
                    None => {
                        if roughness > 0.0 {
                            self.warn(part, "a thin pane is smooth here");
                        }
                        format!("thin = {{ ior = {}, transmittance = {base} }}", number(ior))
                    }
                },
            ));
        }
        let opaque = 1.0 - metal - transmission;
        if opaque > 0.0 {
            layers.push((opaque, format!("plastic = {{ diffuse = {base}, ior = {}{rough} }}", number(ior))));
        }
        let alpha = self.alpha(part, material);
        if alpha < 1.0 {
            layers.iter_mut().for_each(|(weight, _)| *weight *= alpha);
            layers.push((1.0 - alpha, "thin = { ior = 1.0 }".to_owned()));
        }
        let interior = match volume {
            Some(volume) if transmission > 0.0 => self.absorbing(&name, volume),
            _ => None,
        };
        let emission = self.emission(part, material)?;
        let tex_coord = pbr.base_color_texture.as_ref().map_or(0, coordinates);
        Ok(Translated { name: self.define(&name, layers), emission, interior, tex_coord })
    }

    /// Writes a material; its name.
    fn define(&mut self, name: &str, layers: Vec<(f64, String)>) -> String {
        let place = Place::file(&self.data.path);
        let layers: Vec<_> = layers.into_iter().filter(|(weight, _)| *weight > 0.0).collect();
        let sum = layers.len() != 1;
        let mut names = Vec::new();
        for (i, (weight, definition)) in layers.iter().enumerate() {
            let wish = if sum { format!("{name}-{}", i + 1) } else { name.to_owned() };
            let own = self.document.name("material", &wish);
            self.document.table(&place, format!("[material.{}]", quoted(&own)));
            self.document.line(definition);
            names.push((*weight, own));
        }
        if !sum {
            return names.remove(0).1;
        }
        let own = self.document.name("material", name);
        self.document.table(&place, format!("[material.{}]", quoted(&own)));
        let list: Vec<String> = names
            .iter()
            .map(|(weight, n)| format!("{{ material = {}, weight = {} }}", quoted(n), number(*weight)))
            .collect();
        self.document.line(format!("layered = {{ layers = [{}] }}", list.join(", ")));
        own
    }

    /// How opaque it is.
    fn alpha(&mut self, part: &str, material: &Material) -> f64 {
        let alpha = material.pbr_metallic_roughness.base_color_factor[3].clamp(0.0, 1.0);
        let textured = material.pbr_metallic_roughness.base_color_texture.is_some();
        match material.alpha_mode.as_deref() {
            Some("BLEND") => {
                if textured {
                    self.warn(part, "the alpha of the base colour's texture is not looked at");
                }
                alpha
            }
            Some("MASK") => {
                if textured {
                    self.warn(part, "the alpha of the base colour's texture is not looked at");
                }
                if alpha < material.alpha_cutoff.unwrap_or(0.5) { 0.0 } else { 1.0 }
            }
            _ => 1.0,
        }
    }

    /// The medium of a volume: what is left after the attenuation distance d is the attenuation colour, hence
    /// σ_a = −ln(colour)/d.
    fn absorbing(&mut self, name: &str, volume: &super::json::Volume) -> Option<String> {
        let distance = volume.attenuation_distance.filter(|d| d.is_finite() && *d > 0.0)?;
        let sigma = volume.attenuation_color.map(|c| -c.clamp(DARKEST, 1.0).ln() / distance);
        if sigma == [0.0; 3] {
            return None;
        }
        let name = self.document.name("medium", name);
        self.document.table(&Place::file(&self.data.path), format!("[medium.{}]", quoted(&name)));
        self.document.line(format!("sigma_a = {}\nsigma_s = 0.0", color(sigma.map(|s| s + 0.0))));
        Some(name)
    }

    fn emission(&mut self, part: &str, material: &Material) -> Result<Option<[f64; 3]>> {
        let strength = material.extensions.emissive_strength.as_ref().map_or(1.0, |e| e.emissive_strength);
        let mut radiance = material.emissive_factor.map(|c| c * strength);
        if radiance == [0.0; 3] {
            return Ok(None);
        }
        if let Some(texture) = &material.emissive_texture {
            let mean = self.mean(part, texture)?;
            radiance = std::array::from_fn(|i| radiance[i] * mean[i]);
            self.warn(
                part,
                "a lamp's texture is not looked at: it shines alike everywhere, by the texture's mean",
            );
        }
        Ok(Some(radiance))
    }

    /// The mean colour of a texture.
    fn mean(&mut self, part: &str, texture: &TextureReference) -> Result<[f64; 3]> {
        let file = self.image(part, texture)?;
        let raster = match self.document.get(&file) {
            Some(Asset::Bytes(bytes)) => load::decode(std::path::Path::new(&file), bytes, Encoding::Srgb),
            Some(Asset::File(path)) => load::read(path, Encoding::Srgb),
            _ => return Err(self.data.error(part, "its texture is no picture")),
        }?;
        let n = raster.texels.len().max(1) as f64;
        let sum = raster
            .texels
            .iter()
            .fold([0.0; 3], |sum: [f64; 3], t| std::array::from_fn(|i| sum[i] + f64::from(t[i])));
        Ok(sum.map(|s| s / n))
    }

    /// A texture times a colour, as an entry of a material.
    fn texture(&mut self, part: &str, texture: &TextureReference, factor: [f64; 3]) -> Result<String> {
        let file = self.image(part, texture)?;
        let sampler = self.data.root.textures.get(texture.index).and_then(|t| t.sampler);
        let sampler = sampler.and_then(|s| self.data.root.samplers.get(s));
        let wraps = sampler.map_or([None, None], |s| [s.wrap_s, s.wrap_t]).map(|w| w.unwrap_or(10497));
        let wrap = match wraps {
            [10497, 10497] => "",
            [33071, 33071] => ", wrap = \"clamp\"",
            _ => {
                self.warn(
                    part,
                    "a texture that is mirrored, or repeated one way only, is repeated both ways",
                );
                ""
            }
        };
        let tint = if factor == [1.0; 3] { String::new() } else { format!(", tint = {}", color(factor)) };
        // glTF's v goes down from the picture's upper edge, and its transforms come before.
        let identity = super::json::TextureTransform::default();
        let t = texture.extensions.transform.as_ref().unwrap_or(&identity);
        let (sin, cos) = t.rotation.sin_cos();
        let u = [t.scale[0] * cos, t.scale[1] * sin, t.offset[0]];
        let v = [-t.scale[0] * sin, t.scale[1] * cos, t.offset[1]];
        let rows = format!("[{}, {}]", array(&u), array(&[-v[0], -v[1], 1.0 - v[2]]));
        Ok(format!("{{ image = {{ file = {}{wrap}{tint}, uv = {rows} }} }}", quoted(&file)))
    }

    /// The picture of a texture; the name of its file.
    fn image(&mut self, part: &str, texture: &TextureReference) -> Result<String> {
        let source = self.data.root.textures.get(texture.index).and_then(|t| t.source);
        let Some(index) = source.filter(|i| *i < self.data.root.images.len()) else {
            return Err(self.data.error(part, format!("textures[{}] has no picture", texture.index)));
        };
        if let Some(name) = self.images.get(&index) {
            return Ok(name.clone());
        }
        let image_part = format!("images[{index}]");
        let image = &self.data.root.images[index];
        let (uri, view, mime) = (image.uri.clone(), image.buffer_view, image.mime_type.clone());
        let wish = image.name.clone().unwrap_or_else(|| format!("image-{index}"));
        let mime = mime.or_else(|| {
            uri.as_ref().and_then(|u| Some(u.strip_prefix("data:")?.split(';').next()?.to_owned()))
        });
        let ending = match mime.as_deref() {
            Some("image/jpeg") => "jpg",
            _ => "png",
        };
        let file = match (uri, view) {
            (Some(uri), _) => match self.data.uri(&image_part, &uri)? {
                (_, Some(path)) => self.document.file(&path),
                (bytes, None) => self.document.asset(&wish, ending, Asset::Bytes(bytes)),
            },
            (None, Some(view)) => {
                let bytes = self.data.view(&image_part, view)?.to_vec();
                self.document.asset(&wish, ending, Asset::Bytes(bytes))
            }
            (None, None) => {
                return Err(self.data.error(&image_part, "it has neither `uri` nor `bufferView`"));
            }
        };
        self.images.insert(index, file.clone());
        Ok(file)
    }
}

/// The set of texture coordinates that a texture takes.
fn coordinates(texture: &TextureReference) -> usize {
    texture.extensions.transform.as_ref().and_then(|t| t.tex_coord).unwrap_or(texture.tex_coord)
}
