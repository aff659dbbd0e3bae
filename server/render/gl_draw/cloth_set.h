// The cloths of one picture on the device.
#pragma once

#include <epoxy/gl.h>

#include <Eigen/Geometry>
#include <array>
#include <memory>
#include <span>
#include <vector>

#include "server/core/status.h"
#include "server/gl/buffer.h"
#include "server/gl/context.h"
#include "server/render/gl_draw/camera_fit.h"
#include "server/render/gl_draw/draw_programs.h"
#include "server/render/gl_draw/geometry_cache.h"
#include "server/render/renderer.h"
#include "shaders/interface/draw_records.h"

namespace drape::render {

// Cloths of one model, drawn by one call: `count` records from `first` on.
struct ClothGroup {
  std::shared_ptr<const DeviceGeometry> geometry;
  uint32_t first = 0;
  uint32_t count = 0;
  // Whether light is computed for each particle in place of each pixel.
  bool is_lit_at_particles = false;
};

// The extents of the cloths of a picture, as the device found them.
struct ClothMeasures {
  struct Cloth {
    Eigen::AlignedBox3d box_m;  // world frame
    Eigen::Vector3d origin_m;   // of the cloth frame, in the world
    Reaches reaches_m;          // from the origin
    double margin_m = 0;        // for what is drawn around its particles
  };
  std::vector<Cloth> cloths;  // with finite positions only
  ValueRange values;          // range of the finite values; 0, 0 if there are none

  void Add(const ClothMeasures& others);
};

// The colouring's number in the shaders (DRAPE_DRAW_STRAIN, ...).
GLuint ColouringNumber(Colouring colouring);

// The context must be current in every call, on its thread.
class ClothSet {
 public:
  // Takes geometry from the cache and states from the host or from the device's copy, both of which
  // must outlive this. RESOURCE_EXHAUSTED (DEVICE_MEMORY).
  static Result<ClothSet> Load(const PictureSpec& spec, std::span<const DrawnCloth> cloths,
                               const DrawnStates& states, const gl::DeviceLimits& limits,
                               GeometryCache& cache);

  // Computes normals, values and extents on the device, and waits. Reads only the extents back.
  // `directions`: CameraFit::directions(). Of each record. RESOURCE_EXHAUSTED (DEVICE_MEMORY).
  Result<std::vector<ClothMeasures>> Measure(const gl::Program& shade_vertices,
                                             const std::array<Eigen::Vector3d, 8>& directions);
  // Sets the positions of the cloths of some groups as seen from the eye.
  void PlaceBefore(const Eigen::Vector3d& eye_m, std::span<const ClothGroup> groups);
  // The records are complete: uploads them.
  void UploadRecords();
  // Computes the colours of the particles of a group, seen in the frame that is bound. The caller
  // puts a memory barrier behind it.
  void Light(const gl::Program& light_particles, const ClothGroup& group) const;
  // Binds everything for the shaders of one group.
  void Bind(const ClothGroup& group) const;

  // All cloths.
  const std::vector<ClothGroup>& groups() const { return groups_; }
  // One cloth, by its place in the picture.
  ClothGroup GroupOf(uint32_t cloth) const;
  const shader::DrawRecord& record(uint32_t index) const { return records_[index]; }

 private:
  ClothSet() = default;
  Status AddRecords(bool is_tiled, std::span<const DrawnCloth> cloths, GeometryCache& cache);
  Status LoadStates(const DrawnStates& states, int64_t max_block_bytes);
  void Shade(const gl::Program& shade_vertices) const;
  void Dispatch(const gl::Program& program, const ClothGroup& group) const;
  const gl::Buffer& states() const { return shared_states_ ? *shared_states_ : own_states_; }

  Colouring colouring_ = Colouring::kMaterial;
  uint32_t particle_count_ = 0;
  gl::DeviceLimits limits_;
  std::vector<ClothGroup> groups_;
  std::vector<shader::DrawRecord> records_;
  std::vector<uint32_t> group_of_record_;
  std::vector<uint32_t> record_of_cloth_;
  std::vector<Eigen::Vector3d> origins_m_;  // of each record, of the cloth frame in the world
  gl::Buffer records_buffer_;
  gl::Buffer own_states_;
  const gl::Buffer* shared_states_ = nullptr;
  gl::Buffer shaded_;
  gl::Buffer lit_;
  gl::Buffer extents_;
};

}  // namespace drape::render
