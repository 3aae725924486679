//! Textures of a scene file.

use super::context::Context;
use super::schema::{Albedo, Encoding, Named, TextureDef, Wrap};
use super::values::Triple;
use crate::error::Result;
use crate::math::Rgb;
use crate::texture::{self, ImageTexture, Texture};
use glam::{Affine2, Mat2, Vec2};
use toml::Spanned;

const DEFAULT_SQUARES: f32 = 8.0;

/// The named textures of a scene, and which of them were asked for.
#[derive(Debug, Default)]
pub(super) struct Textures {
    named: Vec<(String, Texture)>,
    used: Vec<bool>,
    bytes: usize,
}

impl Textures {
    /// Reads all textures that have a name.
    pub fn load(context: &mut Context, defs: &Named<TextureDef>) -> Result<Self> {
        let mut named = Vec::new();
        for (name, def) in &defs.0 {
            named.push((name.get_ref().clone(), one(context, def.span(), def.get_ref())?));
        }
        let bytes = named.iter().map(|(_, texture)| image_bytes(texture)).sum();
        Ok(Self { used: vec![false; named.len()], named, bytes })
    }

    /// The texture that a material asks for under the key `key`, or a grey one where it does not. Each channel is
    /// from 0 to 1.
    pub fn get(
        &mut self,
        context: &mut Context,
        key: &str,
        albedo: &Option<Spanned<Albedo>>,
        default: f32,
    ) -> Result<Texture> {
        let Some(albedo) = albedo else { return Ok(Texture::constant(Rgb::splat(default))) };
        let span = albedo.span();
        let texture = match albedo.get_ref() {
            Albedo::Constant(color) => Texture::constant(color.0),
            Albedo::Inline(def) => {
                let texture = one(context, span.clone(), def)?;
                self.bytes += image_bytes(&texture);
                texture
            }
            Albedo::Named(name) => match self.named.iter().position(|(n, _)| n == name) {
                Some(i) => {
                    self.used[i] = true;
                    self.named[i].1.clone()
                }
                None => {
                    let known = self.named.iter().map(|(n, _)| n.as_str());
                    return Err(context.source.unknown_name(span, "texture", name, known));
                }
            },
        };
        context.at(span, texture.check_reflectance(key))?;
        Ok(texture)
    }

    /// Memory of all images among the textures.
    pub fn bytes(&self) -> usize {
        self.bytes
    }

    /// Names of the textures that no material asked for.
    pub fn unused(&self) -> impl Iterator<Item = &str> {
        self.named.iter().zip(&self.used).filter(|(_, used)| !**used).map(|((name, _), _)| name.as_str())
    }
}

fn image_bytes(texture: &Texture) -> usize {
    match texture {
        Texture::Image(image) => image.width() as usize * image.height() as usize * size_of::<glam::Vec3>(),
        Texture::Constant(_) | Texture::Checker(_) => 0,
    }
}

/// The map of texture coordinates of two rows.
fn uv_map([u, v]: [Triple; 2]) -> Affine2 {
    let (u, v) = (u.0, v.0);
    let matrix = Mat2::from_cols(Vec2::new(u.x, v.x), Vec2::new(u.y, v.y));
    Affine2 { matrix2: matrix, translation: Vec2::new(u.z, v.z) }
}

fn one(context: &mut Context, span: super::source::Span, def: &TextureDef) -> Result<Texture> {
    match def {
        TextureDef::Constant(color) => Ok(Texture::constant(color.0)),
        TextureDef::Checker(checker) => {
            let squares = checker.squares.as_ref();
            let scale = squares.map_or(Vec2::splat(DEFAULT_SQUARES), |s| s.get_ref().0);
            let uv = checker.uv.map_or(Affine2::IDENTITY, uv_map);
            context.at(
                squares.map_or(span, Spanned::span),
                Texture::checker(checker.even.0, checker.odd.0, scale, uv),
            )
        }
        TextureDef::Image(image) => {
            let encoding = match image.encoding {
                Encoding::Srgb => texture::Encoding::Srgb,
                Encoding::Linear => texture::Encoding::Linear,
            };
            let wrap = match image.wrap {
                Wrap::Repeat => texture::Wrap::Repeat,
                Wrap::Clamp => texture::Wrap::Clamp,
            };
            let mut raster = context.image(&image.file, encoding)?;
            if let Some(tint) = image.tint {
                for texel in &mut raster.texels {
                    *texel = (Rgb::from_array(*texel) * tint.0).to_array();
                }
            }
            let built = ImageTexture::new(raster.width, raster.height, raster.texels, wrap);
            let built = context.at(image.file.span(), built)?;
            Ok(Texture::image(match image.uv {
                Some(rows) => built.with_uv(uv_map(rows)),
                None => built,
            }))
        }
    }
}
