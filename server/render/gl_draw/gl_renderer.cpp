#include "server/render/gl_draw/gl_renderer.h"

#include <epoxy/gl.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <bit>
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
// Larger targets (about 44 bytes per pixel) are freed after each picture.
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
  Status PrepareTarget(const PictureSpec& spec);
  // Empty if the picture has no legend.
  Result<std::vector<shader::LabelRecord>> PrepareLegend(const PictureSpec& spec,
                                                         const ValueRange& range,
                                                         uint32_t group_count);

  Parts parts_;
  GeometryCache cache_;
  std::optional<gl::PictureTarget> target_;  // for the last size
  std::optional<gl::DepthMap> shadow_map_;   // for the last size
  std::optional<GlyphAtlas> glyphs_;         // for the last size
  std::optional<gl::GreyTexture> glyph_texture_;
};

uint32_t ShadowSizeOf_px(const PictureSpec& spec) {
  const uint32_t wanted = std::bit_ceil(2 * std::max(spec.width_px, spec.height_px));
  return std::clamp(wanted, kMinShadowSize_px, kMaxShadowSize_px);
}

uint32_t GroupCount(const PictureSpec& spec, std::span<const DrawnCloth> cloths) {
  uint32_t count = 0;
  if (spec.colouring != Colouring::kColourGroup) return count;
  for (const DrawnCloth& cloth : cloths) count = std::max(count, cloth.model->colour_count());
  return count;
}

// Depths are near_m over the distance along the line of view, 0 where there is nothing
// (ClipFromEye).
std::vector<float> DepthsOf(const gl::PictureTarget& target, double near_m) {
  std::vector<float> depths = target.ReadDepths();
  for (float& depth : depths) depth = static_cast<float>(near_m / depth);
  return depths;
}

Result<Picture> GlRenderer::DrawPicture(const PictureSpec& spec, std::span<const DrawnCloth> cloths,
                                        const DrawnStates& states) {
  DRAPE_RETURN_IF_ERROR(PrepareTarget(spec));
  DRAPE_ASSIGN_OR_RETURN(ClothSet set, ClothSet::Load(spec.colouring, cloths, states,
                                                      parts_.context->limits(), cache_));
  const CameraFit fit = StartFit(spec);
  DRAPE_ASSIGN_OR_RETURN(const ClothMeasures measures,
                         set.Measure(parts_.programs->shade_vertices, fit.directions()));
  const ColliderShapes shapes = CollectColliders(cloths);
  const SceneView view = LookAt(spec, cloths, measures, shapes, fit, shadow_map_->size_px());
  set.PlaceBefore(view.camera.eye_m);
  const uint32_t group_count = GroupCount(spec, cloths);
  DRAPE_ASSIGN_OR_RETURN(const DrawnScene scene, LoadScene(spec, set, view, shapes, group_count));
  DRAPE_ASSIGN_OR_RETURN(const std::vector<shader::LabelRecord> legend,
                         PrepareLegend(spec, view.range, group_count));

  DrawShadows(*parts_.programs, *parts_.vertices, scene, *shadow_map_);
  target_->Begin();
  DrawScene(*parts_.programs, *parts_.vertices, scene, *shadow_map_);
  if (spec.has_depths) {
    DrawPlaneDepths(*parts_.programs, scene);
    target_->ResolveDepths();
  }
  target_->Resolve();
  DRAPE_RETURN_IF_ERROR(DrawLabels(*parts_.programs, scene, legend));
  Picture picture{
      .width_px = spec.width_px,
      .height_px = spec.height_px,
      .rgb = target_->Read(),
      .depths_m = spec.has_depths ? DepthsOf(*target_, view.near_m) : std::vector<float>(),
      .camera = view.camera,
      .bounds_m = view.bounds_m,
      .range = view.range};
  if (uint64_t{spec.width_px} * spec.height_px > kMaxKeptPixels) target_.reset();
  if (glGetError() == GL_OUT_OF_MEMORY) {
    return Status(StatusCode::kResourceExhausted, "DEVICE_MEMORY",
                  "the device ran out of memory while it drew");
  }
  return picture;
}

Status GlRenderer::PrepareTarget(const PictureSpec& spec) {
  const uint32_t shadow_size_px = ShadowSizeOf_px(spec);
  if (!shadow_map_ || shadow_map_->size_px() != shadow_size_px) {
    shadow_map_.reset();
    DRAPE_ASSIGN_OR_RETURN(shadow_map_, gl::DepthMap::Create(shadow_size_px));
  }
  if (target_ && target_->width_px() == spec.width_px && target_->height_px() == spec.height_px) {
    return Status::Ok();
  }
  target_.reset();
  DRAPE_ASSIGN_OR_RETURN(target_, gl::PictureTarget::Create(spec.width_px, spec.height_px));
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
