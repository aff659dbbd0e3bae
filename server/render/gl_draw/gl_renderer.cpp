#include "server/render/gl_draw/gl_renderer.h"

#include <epoxy/gl.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <utility>

#include "server/gl/framebuffer.h"
#include "server/gl/texture.h"
#include "server/render/gl_draw/cloth_set.h"
#include "server/render/gl_draw/collider_shapes.h"
#include "server/render/gl_draw/draw_programs.h"
#include "server/render/gl_draw/geometry_cache.h"
#include "server/render/gl_draw/glyph_atlas.h"
#include "server/render/gl_draw/legend.h"
#include "server/render/gl_draw/page_layout.h"
#include "server/render/gl_draw/passes.h"
#include "server/render/gl_draw/scene_view.h"
#include "shaders/interface/draw_bindings.h"

namespace drape::render {

namespace {

// Shadow maps have about two texels per pixel of the picture: clearing and drawing a large one
// would be most of the time of a small picture.
constexpr uint32_t kMinShadowSize_px = 256;
constexpr uint32_t kMaxShadowSize_px = 2048;
// Limit of the geometry kept for the next picture.
constexpr int64_t kMaxCacheBytes = int64_t{256} << 20;
// Larger targets (about 40 bytes per pixel) are freed after each picture.
constexpr uint64_t kMaxKeptPixels = uint64_t{1} << 22;

class GlRenderer final : public Renderer {
 public:
  // Members in order of construction.
  struct Parts {
    std::unique_ptr<gl::Context> context;
    bool is_shared = false;
    std::optional<DrawPrograms> programs;
    std::optional<VertexArray> vertices;
  };

  explicit GlRenderer(Parts parts)
      : parts_(std::move(parts)),
        cache_(kMaxCacheBytes, parts_.context->limits().storage_block_bytes) {}

  ~GlRenderer() override { parts_.context->MakeCurrent(); }

  std::string device() const override { return parts_.context->renderer(); }
  bool takes_device_copies() const override { return parts_.is_shared; }

  Result<Picture> Draw(const PictureSpec& spec, std::span<const DrawnCloth> cloths,
                       const DrawnStates& states) override {
    DRAPE_CHECK(!states.device || parts_.is_shared, "this renderer takes states of the host");
    parts_.context->MakeCurrent();
    Result<Picture> picture = DrawPicture(spec, cloths, states);
    const std::string reset_reason = parts_.context->ResetReason();
    if (!reset_reason.empty()) {
      return Status(StatusCode::kUnavailable, "RENDERER_LOST", reset_reason);
    }
    return picture;
  }

 private:
  Result<Picture> DrawPicture(const PictureSpec& spec, std::span<const DrawnCloth> cloths,
                              const DrawnStates& states);
  Status PrepareTarget(const PageLayout& layout, uint32_t samples);
  // Empty if the picture has no legend.
  Result<std::vector<shader::LabelRecord>> PrepareLegend(const PictureSpec& spec,
                                                         const ValueRange& range,
                                                         uint32_t group_count);
  // The contents of the tiles, and the places of their cloths before their viewers in `set`.
  Result<std::vector<TileContent>> FillTiles(const PictureSpec& spec,
                                             std::span<const DrawnCloth> cloths,
                                             const PageLayout& layout, ClothSet& set);

  Parts parts_;
  GeometryCache cache_;
  SolidFaceCache solid_faces_;
  std::optional<gl::PictureTarget> target_;  // for the last size, or a larger one
  std::optional<gl::DepthMap> shadow_map_;   // for the last size
  std::optional<GlyphAtlas> glyphs_;         // for the last size
  std::optional<gl::GreyTexture> glyph_texture_;
};

uint32_t ShadowSizeOf_px(const PictureSpec& spec) {
  if (!spec.has_shadows) return 1;
  const uint32_t wanted = std::bit_ceil(2 * std::max(spec.width_px, spec.height_px));
  return std::clamp(wanted, kMinShadowSize_px, kMaxShadowSize_px);
}

uint32_t GroupCount(const PictureSpec& spec, std::span<const DrawnCloth> cloths) {
  uint32_t count = 0;
  if (spec.colouring != Colouring::kColourGroup) return count;
  for (const DrawnCloth& cloth : cloths) count = std::max(count, cloth.model->colour_count());
  return count;
}

PageLayout LayoutOf(const PictureSpec& spec, size_t cloth_count) {
  return {.tile_count = spec.is_tiled ? static_cast<uint32_t>(cloth_count) : 1,
          .width_px = spec.width_px,
          .height_px = spec.height_px,
          .shadow_size_px = ShadowSizeOf_px(spec)};
}

// An image of another size is used again if it is large enough, and not so large that clearing it
// would take long.
bool IsLikeIt(uint32_t has_px, uint32_t wanted_px) {
  return has_px >= wanted_px && has_px / 2 <= wanted_px;
}

// The camera of the environment, in the world.
Camera CameraIn(const Placement& placement, const Camera& camera) {
  Camera moved = camera;
  moved.eye_m += placement.environment_origin_m;
  moved.target_m += placement.environment_origin_m;
  return moved;
}

// The cells of a cloth are a few pixels wide and the light at their corners is that of their
// pixels: the shadow map has two texels per pixel and is blurred over five. Larger, shadows lose
// their edges; smaller, small pictures of many cloths take longer.
constexpr double kMaxLitCell_px = 4;

bool IsLitAtParticles(const ClothMeasures::Cloth& cloth, double cell_m, const SceneView& view,
                      uint32_t height_px) {
  const double distance_m =
      (cloth.box_m.center() - view.camera.eye_m).norm() - cloth.box_m.diagonal().norm() / 2;
  const double pixel = 2 * std::tan(view.camera.vertical_field_of_view_rad / 2) / height_px;
  return cell_m <= kMaxLitCell_px * pixel * distance_m;
}

Result<std::vector<TileContent>> GlRenderer::FillTiles(const PictureSpec& spec,
                                                       std::span<const DrawnCloth> cloths,
                                                       const PageLayout& layout, ClothSet& set) {
  const CameraFit fit = StartFit(spec);
  DRAPE_ASSIGN_OR_RETURN(const std::vector<ClothMeasures> measures,
                         set.Measure(parts_.programs->shade_vertices, fit.directions()));
  std::vector<TileContent> tiles;
  for (uint32_t k = 0; k < layout.tile_count; ++k) {
    TileContent tile;
    const auto shown = spec.is_tiled ? cloths.subspan(k, 1) : cloths;
    PictureSpec tile_spec = spec;
    if (spec.is_tiled) tile_spec.camera = CameraIn(shown[0].placement, *spec.camera);
    tile.groups = spec.is_tiled ? std::vector{set.GroupOf(k)} : set.groups();
    const auto measures_of = [&](const ClothGroup& group) {
      return std::span(measures).subspan(group.first, group.count);
    };
    ClothMeasures all;
    for (const ClothGroup& group : tile.groups) {
      for (const ClothMeasures& cloth : measures_of(group)) all.Add(cloth);
    }
    tile.shapes = CollectColliders(shown);
    tile.view = LookAt(tile_spec, shown, all, tile.shapes, fit, layout.shadow_size_px);
    tile.view.PlaceShadow(layout.ShadowCellOf(k, shadow_map_->size_px()), shadow_map_->size_px());
    DRAPE_ASSIGN_OR_RETURN(tile.legend,
                           PrepareLegend(spec, tile.view.range, GroupCount(spec, shown)));
    set.PlaceBefore(tile.view.camera.eye_m, tile.groups);
    for (ClothGroup& group : tile.groups) {
      if (group.geometry->index_count == 0) continue;
      group.is_lit_at_particles = true;
      for (const ClothMeasures& cloth : measures_of(group)) {
        group.is_lit_at_particles &=
            cloth.cloths.empty() || IsLitAtParticles(cloth.cloths[0], group.geometry->mean_length_m,
                                                     tile.view, layout.height_px);
      }
    }
    tiles.push_back(std::move(tile));
  }
  set.UploadRecords();
  return tiles;
}

Result<Picture> GlRenderer::DrawPicture(const PictureSpec& spec, std::span<const DrawnCloth> cloths,
                                        const DrawnStates& states) {
  const PageLayout layout = LayoutOf(spec, cloths.size());
  DRAPE_RETURN_IF_ERROR(PrepareTarget(layout, spec.samples));
  DRAPE_ASSIGN_OR_RETURN(ClothSet set,
                         ClothSet::Load(spec, cloths, states, parts_.context->limits(), cache_));
  DRAPE_ASSIGN_OR_RETURN(const std::vector<TileContent> tiles,
                         FillTiles(spec, cloths, layout, set));
  DRAPE_ASSIGN_OR_RETURN(const DrawnScene scene, LoadScene(spec, set, layout, tiles,
                                                           GroupCount(spec, cloths), solid_faces_));

  DrawShadows(*parts_.programs, *parts_.vertices, scene, *shadow_map_);
  LightParticles(*parts_.programs, scene, *shadow_map_);
  target_->Begin();
  DrawScene(*parts_.programs, *parts_.vertices, scene, *shadow_map_);
  if (spec.has_depths) DrawPlaneDepths(*parts_.programs, scene);
  DrawLabels(*parts_.programs, scene);
  PackPictures(*parts_.programs, scene, *target_);
  Picture picture{.width_px = spec.width_px,
                  .height_px = layout.picture_height_px(),
                  .rgb = target_->ReadColours(),
                  .depths_m = spec.has_depths ? target_->ReadNumbers() : std::vector<float>(),
                  .camera = spec.is_tiled ? *spec.camera : tiles[0].view.camera,
                  .bounds_m = {},
                  .range = spec.is_tiled ? spec.range.value_or(ValueRange()) : tiles[0].view.range};
  for (const TileContent& tile : tiles) picture.bounds_m.extend(tile.view.bounds_m);
  if (uint64_t{target_->width_px()} * target_->height_px() > kMaxKeptPixels) target_.reset();
  if (glGetError() == GL_OUT_OF_MEMORY) {
    return Status(StatusCode::kResourceExhausted, "DEVICE_MEMORY",
                  "the device ran out of memory while it drew");
  }
  return picture;
}

Status GlRenderer::PrepareTarget(const PageLayout& layout, uint32_t samples) {
  const uint32_t map_size_px = layout.shadow_map_size_px();
  // Of this size exactly: a picture does not depend on those before it, to the last bit.
  if (!shadow_map_ || shadow_map_->size_px() != map_size_px) {
    shadow_map_.reset();
    DRAPE_ASSIGN_OR_RETURN(shadow_map_, gl::DepthMap::Create(map_size_px));
  }
  const uint32_t height_px = layout.picture_height_px();
  if (!target_ || target_->width_px() != layout.width_px || target_->samples() != samples ||
      !IsLikeIt(target_->height_px(), height_px)) {
    target_.reset();
    DRAPE_ASSIGN_OR_RETURN(target_, gl::PictureTarget::Create(layout.width_px, height_px, samples));
  }
  target_->UseRows(height_px);
  return Status::Ok();
}

Result<std::vector<shader::LabelRecord>> GlRenderer::PrepareLegend(const PictureSpec& spec,
                                                                   const ValueRange& range,
                                                                   uint32_t group_count) {
  const uint32_t text_size = LegendTextSize(spec.width_px, spec.height_px);
  if (!spec.has_legend || spec.colouring == Colouring::kMaterial || text_size == 0) {
    return std::vector<shader::LabelRecord>();
  }
  if (!glyphs_ || glyphs_->size_px() != text_size) {
    GlyphAtlas glyphs = GlyphAtlas::Bake(text_size);
    DRAPE_ASSIGN_OR_RETURN(
        gl::GreyTexture texture,
        gl::GreyTexture::Create(glyphs.width(), glyphs.height(), glyphs.texels()));
    glyphs_ = std::move(glyphs);
    glyph_texture_ = std::move(texture);
  }
  glyph_texture_->Bind(DRAPE_DRAW_UNIT_GLYPHS);
  return LayOutLegend(spec, range, group_count, *glyphs_);
}

// A shared context if possible, otherwise a separate one.
Result<std::unique_ptr<gl::Context>> MakeContext(const GlRendererOptions& options,
                                                 bool& is_shared) {
  is_shared = false;
  if (options.share_with) {
    Result<std::unique_ptr<gl::Context>> shared = gl::Context::Create(
        {.accept_software = options.accept_software, .share_with = options.share_with});
    is_shared = shared.ok();
    if (is_shared) return shared;
    spdlog::warn("renderer_not_shared reason=\"{}\"", shared.status().message());
  }
  return gl::Context::Create({.accept_software = options.accept_software});
}

Status CheckVertexStorage() {
  GLint blocks = 0;
  glGetIntegerv(GL_MAX_VERTEX_SHADER_STORAGE_BLOCKS, &blocks);
  if (blocks >= DRAPE_DRAW_VERTEX_STORAGE_BLOCKS) return Status::Ok();
  return Status(StatusCode::kUnavailable, "NO_EGL_DEVICE",
                "vertex shaders of this OpenGL driver read " + std::to_string(blocks) +
                    " storage blocks; pictures need " +
                    std::to_string(DRAPE_DRAW_VERTEX_STORAGE_BLOCKS));
}

}  // namespace

Result<std::unique_ptr<Renderer>> CreateGlRenderer(const GlRendererOptions& options) {
  GlRenderer::Parts parts;
  DRAPE_ASSIGN_OR_RETURN(parts.context, MakeContext(options, parts.is_shared));
  DRAPE_RETURN_IF_ERROR(CheckVertexStorage());
  DRAPE_ASSIGN_OR_RETURN(parts.programs, CompileDrawPrograms(options.shader_dir));
  parts.vertices.emplace();
  return std::unique_ptr<Renderer>(std::make_unique<GlRenderer>(std::move(parts)));
}

}  // namespace drape::render
