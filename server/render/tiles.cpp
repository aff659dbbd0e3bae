#include "server/render/tiles.h"

#include <algorithm>
#include <bit>

#include "server/core/check.h"

namespace drape::render {
namespace {

// The shadows of a tile have at least twice this many texels along a side (gl_draw), and four times
// the pixels of the square around it.
constexpr uint32_t kMinTileEdge_px = 128;

uint64_t ParticlesOf(std::span<const DrawnCloth> cloths) {
  uint64_t particles = 0;
  for (const DrawnCloth& cloth : cloths) particles += cloth.model->particle_count();
  return particles;
}

// Gives `states` their rows back, however the drawing ends.
class RowsAsTheyWere {
 public:
  explicit RowsAsTheyWere(DrawnStates& states)
      : states_(states), first_row_(states.first_row), row_total_(states.row_total) {}
  ~RowsAsTheyWere() {
    states_.first_row = first_row_;
    states_.row_total = row_total_;
  }
  RowsAsTheyWere(const RowsAsTheyWere&) = delete;
  RowsAsTheyWere& operator=(const RowsAsTheyWere&) = delete;

 private:
  DrawnStates& states_;
  const uint32_t first_row_;
  const uint32_t row_total_;
};

}  // namespace

size_t NextPage(const PictureSpec& spec, std::span<const DrawnCloth> cloths) {
  const uint64_t edge_px =
      std::bit_ceil(std::max({spec.width_px, spec.height_px, kMinTileEdge_px}));
  const size_t most = std::max<size_t>(1, kMaxPagePixels / (edge_px * edge_px));
  // Pages of about the same size: their images are made once.
  const size_t pages = (cloths.size() + most - 1) / most;
  const size_t wanted = (cloths.size() + pages - 1) / pages;
  size_t count = 1;
  uint64_t particles = cloths[0].model->particle_count();
  for (; count < wanted; ++count) {
    particles += cloths[count].model->particle_count();
    if (particles > kMaxPageParticles) break;
  }
  return count;
}

Result<Picture> DrawTiles(Renderer& renderer, const PictureSpec& spec,
                          std::span<const DrawnCloth> cloths, DrawnStates& states,
                          const std::function<bool()>& is_cancelled) {
  DRAPE_CHECK(spec.is_tiled && spec.camera.has_value(), "tiles have a camera");
  Picture all;
  all.width_px = spec.width_px;
  all.camera = *spec.camera;
  all.range = spec.range.value_or(ValueRange());
  const size_t pixels = size_t{spec.width_px} * spec.height_px * cloths.size();
  all.rgb.reserve(3 * pixels);
  if (spec.has_depths) all.depths_m.reserve(pixels);
  const RowsAsTheyWere rows(states);
  states.first_row = 0;
  states.row_total = static_cast<uint32_t>(ParticlesOf(cloths));
  size_t most = cloths.size();
  while (!cloths.empty()) {
    if (is_cancelled()) {
      return Status(StatusCode::kCancelled, "CANCELLED", "the client cancelled the request");
    }
    const auto page_cloths = cloths.first(std::min(most, NextPage(spec, cloths)));
    const Result<Picture> page = renderer.Draw(spec, page_cloths, states);
    if (!page.ok() && page.status().code() == StatusCode::kResourceExhausted &&
        page_cloths.size() > 1) {
      most = page_cloths.size() / 2;
      continue;
    }
    if (!page.ok()) return page.status();
    all.rgb.insert(all.rgb.end(), page->rgb.begin(), page->rgb.end());
    all.depths_m.insert(all.depths_m.end(), page->depths_m.begin(), page->depths_m.end());
    all.height_px += page->height_px;
    all.bounds_m.extend(page->bounds_m);
    states.first_row += static_cast<uint32_t>(ParticlesOf(page_cloths));
    cloths = cloths.subspan(page_cloths.size());
  }
  return all;
}

}  // namespace drape::render
