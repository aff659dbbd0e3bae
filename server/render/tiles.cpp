#include "server/render/tiles.h"

#include "server/core/check.h"

namespace drape::render {
namespace {

// The camera of the environment, in the world.
Camera CameraIn(const Placement& placement, const Camera& camera) {
  Camera moved = camera;
  moved.eye_m += placement.environment_origin_m;
  moved.target_m += placement.environment_origin_m;
  return moved;
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

Result<Picture> DrawTiles(Renderer& renderer, const PictureSpec& spec,
                          std::span<const DrawnCloth> cloths, DrawnStates& states,
                          const std::function<bool()>& is_cancelled) {
  DRAPE_CHECK(spec.camera.has_value(), "tiles have a camera");
  Picture all;
  all.width_px = spec.width_px;
  all.camera = *spec.camera;
  all.range = spec.range.value_or(ValueRange());
  uint32_t row_total = 0;
  for (const DrawnCloth& cloth : cloths) row_total += cloth.model->particle_count();
  const RowsAsTheyWere rows(states);
  states.first_row = 0;
  states.row_total = row_total;
  PictureSpec tile_spec = spec;
  for (const DrawnCloth& cloth : cloths) {
    if (is_cancelled()) {
      return Status(StatusCode::kCancelled, "CANCELLED", "the client cancelled the request");
    }
    tile_spec.camera = CameraIn(cloth.placement, *spec.camera);
    DRAPE_ASSIGN_OR_RETURN(const Picture tile, renderer.Draw(tile_spec, {&cloth, 1}, states));
    all.rgb.insert(all.rgb.end(), tile.rgb.begin(), tile.rgb.end());
    all.depths_m.insert(all.depths_m.end(), tile.depths_m.begin(), tile.depths_m.end());
    all.height_px += tile.height_px;
    all.bounds_m.extend(tile.bounds_m);
    states.first_row += cloth.model->particle_count();
  }
  return all;
}

}  // namespace drape::render
