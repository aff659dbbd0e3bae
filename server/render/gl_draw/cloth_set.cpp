#include "server/render/gl_draw/cloth_set.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <string>
#include <utility>

#include "server/core/check.h"
#include "server/gl/device_copy.h"
#include "server/render/gl_draw/float_order.h"
#include "server/render/gl_draw/palette.h"
#include "server/render/gl_draw/projection.h"
#include "shaders/interface/draw_bindings.h"

namespace drape::render {

namespace {

using Eigen::Vector3d;

Status TooLarge(int64_t bytes, int64_t allowed) {
  return Status(StatusCode::kResourceExhausted, "DEVICE_MEMORY",
                "a picture of these cloths needs an array of " + std::to_string(bytes) +
                    " bytes on the device, which allows " + std::to_string(allowed) +
                    "; ask for fewer cloths");
}

// Appends rows of a host column as floats.
void Append(const ScalarColumn& column, size_t first_row, size_t row_count,
            std::vector<float>& words) {
  std::visit(
      [&](const auto& values) {
        DRAPE_CHECK(values.size() >= 3 * (first_row + row_count), "one state per particle");
        const auto begin = values.begin() + static_cast<ptrdiff_t>(3 * first_row);
        for (auto value = begin; value != begin + static_cast<ptrdiff_t>(3 * row_count); ++value) {
          words.push_back(static_cast<float>(*value));
        }
      },
      column);
}

// Sets the sizes of drawn things relative to the mean length of the model's constraints.
void SetSizes(const SceneModel& model, double rest_diagonal_m, shader::DrawRecord& record) {
  const auto scale = static_cast<float>(model.length_scale_m());
  const bool has_surface = !model.triangles().empty();
  record.has_surface = has_surface ? 1 : 0;
  record.line_radius = (has_surface ? 0.07f : 0.045f) * scale;
  record.ball_radius = 0.1f * scale;
  record.pin_radius =
      static_cast<float>(std::clamp(0.3 * scale, 0.004 * rest_diagonal_m, 0.008 * rest_diagonal_m));
}

double FromBits(uint32_t ordered_bits) {
  return FloatFromOrderedBits(ordered_bits);
}

// `extent` has finite positions.
ClothMeasures::Cloth MeasuredCloth(const shader::ClothExtents& extent, const Vector3d& origin_m,
                                   const shader::DrawRecord& record) {
  const Vector3d low(FromBits(extent.low_x), FromBits(extent.low_y), FromBits(extent.low_z));
  const Vector3d high(FromBits(extent.high_x), FromBits(extent.high_y), FromBits(extent.high_z));
  const bool has_surface = record.has_surface != 0;
  Reaches reaches;
  for (size_t k = 0; k < reaches.size(); ++k) reaches[k] = FromBits(extent.reaches[k]);
  return {.box_m = {Vector3d(low + origin_m), Vector3d(high + origin_m)},
          .origin_m = origin_m,
          .reaches_m = reaches,
          .margin_m = has_surface ? record.pin_radius : record.ball_radius};
}

// Of one cloth; empty without finite positions.
ClothMeasures MeasuresOf(const shader::ClothExtents& extent, const Vector3d& origin_m,
                         const shader::DrawRecord& record) {
  if (extent.low_x > extent.high_x) return {};
  return {.cloths = {MeasuredCloth(extent, origin_m, record)},
          .values = {FromBits(extent.low_value), FromBits(extent.high_value)}};
}

shader::vec4 RecordColour(Colouring colouring, bool has_surface, uint32_t cloth_index) {
  if (colouring != Colouring::kColourGroup) return ClothColour(cloth_index);
  return LinearFromHex(has_surface ? 0xd3d7dd : 0x8a939e);
}

}  // namespace

GLuint ColouringNumber(Colouring colouring) {
  switch (colouring) {
    case Colouring::kMaterial:
      return DRAPE_DRAW_NO_VALUE;
    case Colouring::kStrain:
      return DRAPE_DRAW_STRAIN;
    case Colouring::kColourGroup:
      return DRAPE_DRAW_GROUPS;
    case Colouring::kSpeed:
    case Colouring::kContact:
      return DRAPE_DRAW_SIZE;
  }
  return DRAPE_DRAW_NO_VALUE;
}

void ClothMeasures::Add(const ClothMeasures& others) {
  if (others.cloths.empty()) return;
  const bool is_first = cloths.empty();
  values.low = is_first ? others.values.low : std::min(values.low, others.values.low);
  values.high = is_first ? others.values.high : std::max(values.high, others.values.high);
  cloths.insert(cloths.end(), others.cloths.begin(), others.cloths.end());
}

Result<ClothSet> ClothSet::Load(const PictureSpec& spec, std::span<const DrawnCloth> cloths,
                                const DrawnStates& states, const gl::DeviceLimits& limits,
                                GeometryCache& cache) {
  ClothSet set;
  set.colouring_ = spec.colouring;
  set.limits_ = limits;
  DRAPE_RETURN_IF_ERROR(set.AddRecords(spec.is_tiled, cloths, cache));
  if (cloths.empty()) return set;
  DRAPE_RETURN_IF_ERROR(set.LoadStates(states, limits.storage_block_bytes));
  DRAPE_ASSIGN_OR_RETURN(set.records_buffer_,
                         gl::Buffer::Create(set.records_.size() * sizeof(shader::DrawRecord)));
  DRAPE_ASSIGN_OR_RETURN(set.extents_,
                         gl::Buffer::Create(set.records_.size() * sizeof(shader::ClothExtents)));
  const size_t shaded_bytes = set.particle_count_ * sizeof(shader::vec4);
  if (static_cast<int64_t>(shaded_bytes) > limits.storage_block_bytes) {
    return TooLarge(static_cast<int64_t>(shaded_bytes), limits.storage_block_bytes);
  }
  DRAPE_ASSIGN_OR_RETURN(set.shaded_, gl::Buffer::Create(shaded_bytes));
  DRAPE_ASSIGN_OR_RETURN(
      set.lit_, gl::Buffer::Create(set.particle_count_ * DRAPE_DRAW_LIT_WORDS * sizeof(uint32_t)));
  return set;
}

// Cloths of one model are consecutive; models are in the order of their first cloth.
Status ClothSet::AddRecords(bool is_tiled, std::span<const DrawnCloth> cloths,
                            GeometryCache& cache) {
  cache.DropEndedModels();
  std::vector<uint32_t> first_particles;
  std::map<const SceneModel*, uint32_t> first_cloths;  // with that model
  uint64_t particles = 0;
  for (const DrawnCloth& cloth : cloths) {
    first_cloths.try_emplace(cloth.model.get(), static_cast<uint32_t>(first_particles.size()));
    first_particles.push_back(static_cast<uint32_t>(particles));
    particles += cloth.model->particle_count();
  }
  if (6 * particles > UINT32_MAX) {
    return TooLarge(static_cast<int64_t>(6 * particles * sizeof(float)),
                    limits_.storage_block_bytes);
  }
  particle_count_ = static_cast<uint32_t>(particles);

  std::vector<uint32_t> order(cloths.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    return first_cloths.at(cloths[a].model.get()) < first_cloths.at(cloths[b].model.get());
  });
  record_of_cloth_.resize(cloths.size());
  const SceneModel* model_before = nullptr;
  for (const uint32_t index : order) {
    const DrawnCloth& cloth = cloths[index];
    if (cloth.model.get() != model_before) {
      DRAPE_ASSIGN_OR_RETURN(std::shared_ptr<const DeviceGeometry> geometry,
                             cache.Acquire(cloth.model));
      groups_.push_back({std::move(geometry), static_cast<uint32_t>(records_.size()), 0});
      model_before = cloth.model.get();
    }
    ++groups_.back().count;
    const GeometryLayout& layout = groups_.back().geometry->layout;
    shader::DrawRecord record = {};
    SetSizes(*cloth.model, groups_.back().geometry->rest_diagonal_m, record);
    record.colour = RecordColour(colouring_, record.has_surface != 0, is_tiled ? 0 : index);
    record.particle_count = cloth.model->particle_count();
    record.constraint_count = cloth.model->constraint_count();
    record.positions = 3 * first_particles[index];
    record.velocities = 3 * (particle_count_ + first_particles[index]);
    record.shaded = first_particles[index];
    record.corner_offsets = layout.corner_offsets;
    record.corners = layout.corners;
    record.end_offsets = layout.end_offsets;
    record.ends = layout.ends;
    record.constraints = layout.constraints;
    record.pins = layout.pins;
    record.pin_count = cloth.model->pin_count();
    record_of_cloth_[index] = static_cast<uint32_t>(records_.size());
    group_of_record_.push_back(static_cast<uint32_t>(groups_.size() - 1));
    records_.push_back(record);
    origins_m_.push_back(cloth.placement.WorldFromCloth(Vector3d::Zero()));
  }
  return Status::Ok();
}

Status ClothSet::LoadStates(const DrawnStates& states, int64_t max_block_bytes) {
  const size_t columns = ColouringNumber(colouring_) == DRAPE_DRAW_SIZE ? 2 : 1;
  const size_t bytes = columns * 3 * sizeof(float) * particle_count_;
  if (states.device) {
    const uint32_t row_total = std::max(states.row_total, particle_count_);
    DRAPE_CHECK(states.device->buffer.size_bytes() >= columns * 3 * sizeof(float) * row_total,
                "one state per particle");
    for (shader::DrawRecord& record : records_) {
      record.positions += 3 * states.first_row;
      record.velocities += 3 * (row_total - particle_count_ + states.first_row);
    }
    if (static_cast<int64_t>(states.device->buffer.size_bytes()) > max_block_bytes) {
      return TooLarge(static_cast<int64_t>(states.device->buffer.size_bytes()), max_block_bytes);
    }
    states.device->ready.WaitOnDevice();
    shared_states_ = &states.device->buffer;
    return Status::Ok();
  }
  if (static_cast<int64_t>(bytes) > max_block_bytes) {
    return TooLarge(static_cast<int64_t>(bytes), max_block_bytes);
  }
  std::vector<float> words;
  words.reserve(bytes / sizeof(float));
  Append(states.host.positions_m, states.first_row, particle_count_, words);
  if (columns == 2) {
    Append(states.host.velocities_m_per_s, states.first_row, particle_count_, words);
  }
  DRAPE_ASSIGN_OR_RETURN(own_states_, gl::Buffer::Create(bytes));
  own_states_.Upload(0, std::as_bytes(std::span(words)));
  return Status::Ok();
}

Result<std::vector<ClothMeasures>> ClothSet::Measure(const gl::Program& shade_vertices,
                                                     const std::array<Vector3d, 8>& directions) {
  std::vector<ClothMeasures> measures;
  if (records_.empty()) return measures;
  shader::DrawReaches reaches;
  for (size_t k = 0; k < directions.size(); ++k) {
    reaches.directions[k] = ToShader(directions[k], 0);
  }
  DRAPE_ASSIGN_OR_RETURN(gl::Buffer reaches_buffer, gl::Buffer::Create(sizeof(reaches)));
  reaches_buffer.Upload(0, std::as_bytes(std::span(&reaches, 1)));
  reaches_buffer.BindUniforms(DRAPE_DRAW_BINDING_REACHES);
  constexpr uint32_t kNone = UINT32_MAX;
  std::vector<shader::ClothExtents> extents(records_.size(),
                                            {kNone, kNone, kNone, kNone, 0, 0, 0, 0, {}});
  extents_.Upload(0, std::as_bytes(std::span(extents)));
  records_buffer_.Upload(0, std::as_bytes(std::span(records_)));
  Shade(shade_vertices);
  extents_.Download(0, std::as_writable_bytes(std::span(extents)));

  for (size_t index = 0; index < extents.size(); ++index) {
    measures.push_back(MeasuresOf(extents[index], origins_m_[index], records_[index]));
  }
  return measures;
}

void ClothSet::Shade(const gl::Program& shade_vertices) const {
  shade_vertices.Use();
  shade_vertices.SetUniform(DRAPE_DRAW_UNIFORM_COLOURING, ColouringNumber(colouring_));
  extents_.BindStorage(DRAPE_DRAW_BINDING_EXTENTS);
  for (const ClothGroup& group : groups_) Dispatch(shade_vertices, group);
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
}

void ClothSet::Light(const gl::Program& light_particles, const ClothGroup& group) const {
  light_particles.Use();
  light_particles.SetUniform(DRAPE_DRAW_UNIFORM_COLOURING, ColouringNumber(colouring_));
  Dispatch(light_particles, group);
}

// An invocation for each particle (x) of each cloth (y).
void ClothSet::Dispatch(const gl::Program& program, const ClothGroup& group) const {
  Bind(group);
  const GLuint work_groups =
      (records_[group.first].particle_count + kShadeLocalSize - 1) / kShadeLocalSize;
  for (uint32_t done = 0; done < group.count;) {
    const uint32_t count = std::min(group.count - done, limits_.work_group_count_y);
    program.SetUniform(DRAPE_DRAW_UNIFORM_FIRST_CLOTH, group.first + done);
    glDispatchCompute(work_groups, count, 1);
    done += count;
  }
}

void ClothSet::PlaceBefore(const Vector3d& eye_m, std::span<const ClothGroup> groups) {
  for (const ClothGroup& group : groups) {
    for (uint32_t index = group.first; index < group.first + group.count; ++index) {
      records_[index].offset = ToShader(Vector3d(origins_m_[index] - eye_m), 0);
    }
  }
}

void ClothSet::UploadRecords() {
  if (!records_.empty()) records_buffer_.Upload(0, std::as_bytes(std::span(records_)));
}

ClothGroup ClothSet::GroupOf(uint32_t cloth) const {
  const uint32_t record = record_of_cloth_[cloth];
  return {groups_[group_of_record_[record]].geometry, record, 1};
}

void ClothSet::Bind(const ClothGroup& group) const {
  records_buffer_.BindStorage(DRAPE_DRAW_BINDING_CLOTHS);
  states().BindStorage(DRAPE_DRAW_BINDING_STATES);
  shaded_.BindStorage(DRAPE_DRAW_BINDING_SHADED);
  lit_.BindStorage(DRAPE_DRAW_BINDING_LIT);
  group.geometry->surface.BindStorage(DRAPE_DRAW_BINDING_SURFACE);
  group.geometry->constraints.BindStorage(DRAPE_DRAW_BINDING_CONSTRAINTS);
}

}  // namespace drape::render
