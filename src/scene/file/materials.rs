//! Materials of a scene file.

use super::context::Context;
use super::schema::{
    ConductorDef, DielectricDef, DistributionKind, LayeredDef, MaskingKind, MaterialDef, Named, PlasticDef,
    SidedDef,
};
use super::source::Span;
use super::textures::Textures;
use crate::bsdf::{
    Conductor, Dielectric, Diffuse, Layered, Masking, Material, Mirror, NormalDistribution, Phong, Plastic,
    PlasticSettings, Sided, Thin, metals,
};
use crate::error::Result;
use crate::math::Rgb;
use toml::Spanned;

/// The materials of a scene, by index, and which of them were asked for.
#[derive(Debug, Default)]
pub(super) struct Materials {
    names: Vec<(String, Span)>,
    used: Vec<bool>,
    /// The materials, by index.
    pub all: Vec<Material>,
    black: Option<u32>,
}

impl Materials {
    /// Builds all materials of the file, in its order.
    pub fn load(context: &mut Context, textures: &mut Textures, defs: &Named<MaterialDef>) -> Result<Self> {
        let mut built: Vec<Option<Material>> = Vec::new();
        for (name, def) in &defs.0 {
            built.push(match def.get_ref() {
                MaterialDef::Layered(_) | MaterialDef::Sided(_) => None,
                other => Some(simple(context, textures, name.span(), other)?),
            });
        }
        let mut materials = Self { used: vec![false; built.len()], ..Self::default() };
        // Layers may be sided, but no side is a sum.
        for i in 0..built.len() {
            if let MaterialDef::Sided(def) = defs.0[i].1.get_ref() {
                built[i] = Some(sided(context, defs, &built, def, &mut materials.used)?);
            }
        }
        for (i, (name, def)) in defs.0.iter().enumerate() {
            let material = match (def.get_ref(), &built[i]) {
                (MaterialDef::Layered(def), _) => layered(context, defs, &built, def, &mut materials.used)?,
                (_, Some(material)) => material.clone(),
                (_, None) => Material::Null,
            };
            let bound = material.albedo_bound();
            if bound > 1.0 + 1e-4 {
                let message = format!(
                    "material `{name}` can reflect up to {bound:.3} times the light it gets",
                    name = name.get_ref()
                );
                context.warn(name.span(), message);
            }
            materials.names.push((name.get_ref().clone(), name.span()));
            materials.all.push(material);
        }
        Ok(materials)
    }

    /// The index of a material by its name.
    pub fn index(&mut self, context: &Context, name: &Spanned<String>) -> Result<u32> {
        match self.names.iter().position(|(n, _)| n == name.get_ref()) {
            Some(i) => {
                self.used[i] = true;
                Ok(i as u32)
            }
            None => {
                let known = self.names.iter().map(|(n, _)| n.as_str());
                Err(context.source.unknown_name(name.span(), "material", name.get_ref(), known))
            }
        }
    }

    /// The index of a material that reflects nothing, for lamps without a material.
    pub fn black(&mut self) -> Result<u32, String> {
        if let Some(index) = self.black {
            return Ok(index);
        }
        let index = self.all.len() as u32;
        self.all.push(Material::Diffuse(Diffuse::new(Rgb::ZERO.into())?));
        self.black = Some(index);
        Ok(index)
    }

    /// Names of all materials, by index; the black one of lamps has an empty name.
    pub fn names(&self) -> Vec<String> {
        let named = self.names.iter().map(|(name, _)| name.clone());
        named.chain(self.black.map(|_| String::new())).collect()
    }

    /// Names and places of the materials that neither a shape nor a layered material asked for.
    pub fn unused(&self) -> Vec<(String, Span)> {
        self.names
            .iter()
            .zip(&self.used)
            .filter(|(_, used)| !**used)
            .map(|(entry, _)| entry.clone())
            .collect()
    }
}

/// A material that refers to no other.
fn simple(context: &mut Context, textures: &mut Textures, span: Span, def: &MaterialDef) -> Result<Material> {
    match def {
        MaterialDef::Diffuse(def) => {
            let reflectance = textures.get(context, "reflectance", &def.reflectance, 0.5)?;
            context.at(span, Diffuse::new(reflectance)).map(Material::Diffuse)
        }
        MaterialDef::Mirror(def) => {
            let reflectance = textures.get(context, "reflectance", &def.reflectance, 1.0)?;
            context.at(span, Mirror::new(reflectance)).map(Material::Mirror)
        }
        MaterialDef::Conductor(def) => conductor(context, textures, span, def),
        MaterialDef::Dielectric(def) => dielectric(context, textures, span, def),
        MaterialDef::Phong(def) => {
            let diffuse = textures.get(context, "diffuse", &def.diffuse, 0.0)?;
            let specular = textures.get(context, "specular", &def.specular, 0.0)?;
            context.at(span, Phong::new(diffuse, specular, def.exponent.get())).map(Material::Phong)
        }
        MaterialDef::Thin(def) => {
            let reflectance = textures.get(context, "reflectance", &def.reflectance, 1.0)?;
            let transmittance = textures.get(context, "transmittance", &def.transmittance, 1.0)?;
            let (ior, around) = (number(def.ior, 1.5), number(def.exterior_ior, 1.0));
            context.at(span, Thin::new(ior, around, reflectance, transmittance)).map(Material::Thin)
        }
        MaterialDef::Plastic(def) => plastic(context, textures, span, def),
        MaterialDef::Layered(_) | MaterialDef::Sided(_) | MaterialDef::Null(_) => Ok(Material::Null),
    }
}

fn conductor(
    context: &mut Context,
    textures: &mut Textures,
    span: Span,
    def: &ConductorDef,
) -> Result<Material> {
    let roughness = def.roughness.map_or(0.0, |r| r.get());
    let tint = textures.get(context, "reflectance", &def.reflectance, 1.0)?;
    let built = match (&def.metal, &def.eta, &def.k) {
        (Some(metal), None, None) => {
            if metals::find(metal.get_ref()).is_err() {
                return Err(context.source.unknown_name(
                    metal.span(),
                    "metal",
                    metal.get_ref(),
                    metals::names(),
                ));
            }
            Conductor::metal(metal.get_ref(), roughness, tint)
        }
        (None, Some(eta), Some(k)) => Conductor::new(eta.0, k.0, roughness, tint),
        (None, None, None) if def.reflectance.is_some() => Conductor::without_fresnel(roughness, tint),
        _ => Err("a conductor has either `metal`, or both `eta` and `k`, or `reflectance` alone".into()),
    };
    let built = built.map(|conductor| {
        conductor.with_distribution(distribution(def.distribution)).with_masking(masking(def.masking))
    });
    context.at(span, built).map(Material::Conductor)
}

fn dielectric(
    context: &mut Context,
    textures: &mut Textures,
    span: Span,
    def: &DielectricDef,
) -> Result<Material> {
    let reflectance = textures.get(context, "reflectance", &def.reflectance, 1.0)?;
    let transmittance = textures.get(context, "transmittance", &def.transmittance, 1.0)?;
    let roughness = def.roughness.map_or(0.0, |r| r.get());
    let (inside, outside) = (number(def.ior, 1.5), number(def.exterior_ior, 1.0));
    let built = Dielectric::new(inside, outside, roughness, reflectance, transmittance);
    // In the words of the file.
    let built = built.map_err(|e| {
        e.replace("int_ior", "ior").replace("ext_ior", "exterior_ior").replace("alpha", "roughness")
    });
    let built = built.map(|dielectric| {
        dielectric.with_distribution(distribution(def.distribution)).with_masking(masking(def.masking))
    });
    context.at(span, built).map(Material::Dielectric)
}

fn number(x: Option<super::values::Positive>, default: f32) -> f32 {
    x.map_or(default, |x| x.get())
}

fn plastic(context: &mut Context, textures: &mut Textures, span: Span, def: &PlasticDef) -> Result<Material> {
    let settings = PlasticSettings {
        diffuse: textures.get(context, "diffuse", &def.diffuse, 0.5)?,
        specular: textures.get(context, "specular", &def.specular, 1.0)?,
        ior: number(def.ior, 1.5),
        exterior_ior: number(def.exterior_ior, 1.0),
        roughness: def.roughness.map_or(0.0, |r| r.get()),
        distribution: distribution(def.distribution),
        masking: masking(def.masking),
        nonlinear: def.nonlinear,
    };
    context.at(span, Plastic::new(settings)).map(|plastic| Material::Plastic(Box::new(plastic)))
}

/// One material outside, another one inside; marks them as used.
fn sided(
    context: &Context,
    defs: &Named<MaterialDef>,
    built: &[Option<Material>],
    def: &SidedDef,
    used: &mut [bool],
) -> Result<Material> {
    let mut face = |name: &Option<toml::Spanned<String>>| {
        let Some(name) = name else { return Ok(None) };
        let Some(i) = defs.names().position(|n| n == name.get_ref()) else {
            return Err(context.source.unknown_name(name.span(), "material", name.get_ref(), defs.names()));
        };
        used[i] = true;
        // Whether it can be a side is for `Sided` to say, but a sum is not built yet.
        let material = built[i].clone().ok_or("a side can be neither layered nor sided itself".to_owned());
        let material = material.and_then(|m| Sided::new(Some(m.clone()), None).map(|_| m));
        context.at(name.span(), material).map(Some)
    };
    let (front, back) = (face(&def.front)?, face(&def.back)?);
    context.at(0..0, Sided::new(front, back)).map(Material::Sided)
}

fn distribution(kind: DistributionKind) -> NormalDistribution {
    match kind {
        DistributionKind::Ggx => NormalDistribution::Ggx,
        DistributionKind::Beckmann => NormalDistribution::Beckmann,
    }
}

fn masking(kind: MaskingKind) -> Masking {
    match kind {
        MaskingKind::Correlated => Masking::Correlated,
        MaskingKind::Separable => Masking::Separable,
    }
}

/// A sum of materials that are not sums themselves; marks them as used.
fn layered(
    context: &Context,
    defs: &Named<MaterialDef>,
    built: &[Option<Material>],
    def: &LayeredDef,
    used: &mut [bool],
) -> Result<Material> {
    let mut layers = Vec::new();
    for layer in def.layers.get_ref() {
        let (name, span) = (layer.material.get_ref(), layer.material.span());
        let Some(i) = defs.names().position(|n| n == name) else {
            return Err(context.source.unknown_name(span, "material", name, defs.names()));
        };
        match &built[i] {
            Some(material) if !material.is_null() => layers.push((layer.weight.get(), material.clone())),
            _ => {
                let message =
                    format!("`{name}` is a layered or a null material, and cannot be a layer of another");
                return Err(context.source.error(span, message));
            }
        }
        used[i] = true;
    }
    context.at(def.layers.span(), Layered::new(layers)).map(Material::Layered)
}
