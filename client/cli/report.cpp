#include "client/cli/report.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace drape::cli {
namespace {

using Json = nlohmann::ordered_json;

void AddImpulses(const SampleImpulses& impulses, Json& json) {
  json["colliders"] = Json::array();
  json["pins"] = Json::array();
  for (const auto& [impulse, angular] : impulses.colliders) {
    json["colliders"].push_back({{"impulse_n_s", impulse}, {"angular_impulse_n_m_s", angular}});
  }
  for (const auto& [particle, impulse] : impulses.pins) {
    json["pins"].push_back({{"particle", particle}, {"impulse_n_s", impulse}});
  }
}

// Into the entries of colliders with a mass.
void AddBodies(const v1::StepReport& sample, Json& json) {
  for (const v1::BodyState& body : sample.bodies()) {
    if (json["colliders"].size() <= body.collider()) continue;
    Json& collider = json["colliders"][body.collider()];
    collider["position_m"] = body.position_m();
    collider["rotation_xyzw"] = body.rotation_xyzw();
    collider["velocity_m_per_s"] = body.velocity_m_per_s();
    collider["angular_velocity_rad_per_s"] = body.angular_velocity_rad_per_s();
  }
}

Json SampleJson(const v1::StepReport& sample, double time_step_s) {
  Json json = {
      {"step", sample.step()},
      {"time_s", static_cast<double>(sample.step()) * time_step_s},
      {"max_strain", sample.max_strain()},
      {"rms_strain", sample.rms_strain()},
      {"strain_p50", sample.strain_p50()},
      {"strain_p90", sample.strain_p90()},
      {"strain_p99", sample.strain_p99()},
      {"rms_motion_m", sample.rms_motion_m()},
      {"kinetic_energy_j", sample.kinetic_energy_j()},
      {"potential_energy_j", sample.potential_energy_j()},
      {"strain_energy_j", sample.strain_energy_j()},
      {"lowest_m", sample.lowest_m()},
      {"contacts", sample.contacts()},
      {"max_penetration_m", sample.max_penetration_m()},
      {"iterations", sample.iterations()},
      {"max_residual_m", sample.max_residual_m()},
      {"near_pairs", sample.near_pairs()},
      // null: nothing is near.
      {"smallest_distance_m",
       sample.has_smallest_distance_m() ? Json(sample.smallest_distance_m()) : Json(nullptr)},
      {"crossings", sample.crossings()}};
  // Only of cloths with a frame budget.
  if (sample.iteration_cap() > 0) json["iteration_cap"] = sample.iteration_cap();
  if (sample.asleep()) json["asleep"] = true;
  return json;
}

Json RepairJson(const v1::MeshRepair& repair) {
  return {{"welded_vertices", repair.welded_vertices()},
          {"collapsed_vertices", repair.collapsed_vertices()},
          {"largest_shift_m", repair.largest_shift_m()},
          {"flipped_edges", repair.flipped_edges()},
          {"dropped_triangles", repair.dropped_triangles()},
          {"turned_triangles", repair.turned_triangles()},
          {"non_manifold_edges", repair.non_manifold_edges()},
          {"loose_vertices", repair.loose_vertices()}};
}

Json CorrectionJson(const v1::StartCorrection& correction) {
  return {{"described_error", correction.described_error()},
          {"start_error", correction.start_error()},
          {"let_out_edges", correction.let_out_edges()},
          {"largest_let_out", correction.largest_let_out()}};
}

Json LimitJson(const v1::ElasticLimit& limit) {
  return {{"elements", limit.elements()},
          {"least_share", limit.least_share()},
          {"enough_substeps", limit.enough_substeps()}};
}

Json ClothJson(const ClothReport& cloth, double time_step_s) {
  Json samples = Json::array();
  for (size_t k = 0; k < cloth.samples.size(); ++k) {
    samples.push_back(SampleJson(cloth.samples[k], time_step_s));
    if (!cloth.impulses[k]) continue;
    AddImpulses(*cloth.impulses[k], samples.back());
    AddBodies(cloth.samples[k], samples.back());
  }
  // Warnings are counted since creation: the last report has them all. Sorted by name. Corrections
  // made when a cloth is created come first.
  std::map<std::string, uint64_t> warnings;
  if (!cloth.samples.empty()) {
    const v1::StepReport& last = cloth.samples.back();
    warnings = {last.warnings().begin(), last.warnings().end()};
  }
  if (const uint32_t dropped = cloth.shape.dropped_triangles(); dropped > 0) {
    warnings["dropped_triangles"] = dropped;
  }
  if (cloth.shape.has_start_correction()) warnings["start_corrected"] = 1;
  Json json = {{"id", std::to_string(cloth.id)},
               {"particles", cloth.shape.particles()},
               {"constraints", cloth.shape.distance_constraints()},
               {"colours", cloth.shape.colours()},
               {"plan", cloth.shape.plan()}};
  // Only of cloths with repaired meshes.
  if (cloth.shape.has_mesh_repair()) json["mesh_repair"] = RepairJson(cloth.shape.mesh_repair());
  // Only of cloths with a corrected start.
  if (cloth.shape.has_start_correction()) {
    json["start_correction"] = CorrectionJson(cloth.shape.start_correction());
  }
  // Only of cloths of which some bending or shear is softer than requested.
  if (cloth.shape.has_elastic_limit()) {
    json["elastic_limit"] = LimitJson(cloth.shape.elastic_limit());
  }
  json["samples"] = std::move(samples);
  json["warnings"] = Json(warnings);
  json["faulted"] = cloth.fault.has_value();
  json["fault_reason"] = cloth.fault ? cloth.fault->fault_reason() : "";
  return json;
}

std::string LimitText(const v1::ElasticLimit& limit) {
  char text[128];
  std::snprintf(text, sizeof(text),
                "%u elements of bending or shear are softer than requested, one acts with %.2g %%",
                limit.elements(), 100 * limit.least_share());
  const std::string cure = limit.enough_substeps() > 0
                               ? "settings.substeps " + std::to_string(limit.enough_substeps())
                               : "no number of substeps";
  return text + ("; " + cure + " would do");
}

// A part of the sentence about what was done to a mesh, where anything was.
void AppendCount(uint32_t count, const char* what, std::string* line) {
  if (count == 0) return;
  *line += (line->empty() ? "" : ", ") + std::to_string(count) + " " + what;
}

std::string RepairText(const v1::MeshRepair& repair) {
  std::string text;
  AppendCount(repair.welded_vertices(), "vertices welded", &text);
  AppendCount(repair.collapsed_vertices(), "vertices collapsed at short edges", &text);
  AppendCount(repair.flipped_edges(), "edges of slivers flipped", &text);
  AppendCount(repair.dropped_triangles(), "triangles left out", &text);
  AppendCount(repair.turned_triangles(), "triangles turned", &text);
  AppendCount(repair.non_manifold_edges(), "edges of more than two triangles", &text);
  AppendCount(repair.loose_vertices(), "vertices of no triangle, which nothing holds", &text);
  if (repair.largest_shift_m() > 0) {
    char shift[64];
    std::snprintf(shift, sizeof(shift), "; no vertex moved farther than %.3g m",
                  repair.largest_shift_m());
    text += shift;
  }
  return text;
}

}  // namespace

RunReport::RunReport(const v1::ServerInfo& server, const ScenePlayer& player)
    : scene_(player.scene().name()),
      backend_(server.backend()),
      device_(server.device()),
      time_step_s_(player.scene().time_step_s()) {
  for (const PlayedCloth& cloth : player.cloths()) {
    cloths_.push_back({cloth.id, cloth.shape, {}, {}, {}});
  }
}

void RunReport::Add(uint64_t steps, const AdvanceResult& result) {
  steps_ += steps;
  wait_s_ += result.wait_s;
  device_us_ += result.device_us;
  for (size_t k = 0; k < result.reports.size(); ++k) {
    ClothReport& cloth = cloths_.at(k);
    if (result.reports[k].faulted() && !cloth.fault) cloth.fault = result.reports[k];
    cloth.samples.push_back(result.reports[k]);
    cloth.samples.back().set_step(steps_);  // a faulted cloth has stopped at an earlier one
  }
  AddImpulses(result);
}

void RunReport::AddImpulses(const AdvanceResult& result) {
  std::map<ClothId, SampleImpulses*> of_cloths;
  for (ClothReport& cloth : cloths_) {
    cloth.impulses.resize(cloth.samples.size());
    if (!result.has_impulses || cloth.impulses.empty()) continue;
    of_cloths[cloth.id] = &cloth.impulses.back().emplace();
  }
  const auto vector = [](const auto& numbers, int row) -> SampleImpulses::Vector {
    return {numbers[3 * row], numbers[3 * row + 1], numbers[3 * row + 2]};
  };
  const v1::ColliderImpulses& colliders = result.collider_impulses;
  for (int row = 0; row < colliders.cloth_ids_size(); ++row) {
    of_cloths.at(colliders.cloth_ids(row))
        ->colliders.push_back({vector(colliders.impulses_n_s(), row),
                               vector(colliders.angular_impulses_n_m_s(), row)});
  }
  const v1::PinImpulses& pins = result.pin_impulses;
  for (int row = 0; row < pins.cloth_ids_size(); ++row) {
    of_cloths.at(pins.cloth_ids(row))
        ->pins.push_back({pins.particles(row), vector(pins.impulses_n_s(), row)});
  }
}

double RunReport::wall_ms_per_step() const {
  return steps_ == 0 ? 0 : wait_s_ * 1e3 / static_cast<double>(steps_);
}

double RunReport::device_ms_per_step() const {
  return steps_ == 0 ? 0 : static_cast<double>(device_us_) * 1e-3 / static_cast<double>(steps_);
}

std::string ReportJson(const RunReport& report) {
  Json cloths = Json::array();
  for (const ClothReport& cloth : report.cloths()) {
    cloths.push_back(ClothJson(cloth, report.time_step_s()));
  }
  const Json json = {{"scene", report.scene()},
                     {"backend", report.backend()},
                     {"device", report.device()},
                     {"steps", report.steps()},
                     {"wall_ms_per_step", report.wall_ms_per_step()},
                     {"device_ms_per_step", report.device_ms_per_step()},
                     {"cloths", std::move(cloths)}};
  return json.dump(1) + "\n";
}

std::string ImportLines(const RunReport& report) {
  std::string lines;
  for (size_t k = 0; k < report.cloths().size(); ++k) {
    const v1::ClothShape& shape = report.cloths()[k].shape;
    const std::string name = report.scene() + ": cloth " + std::to_string(k);
    if (shape.has_mesh_repair()) {
      lines += name + ": mesh repaired (" + RepairText(shape.mesh_repair()) + ")\n";
    }
    const v1::StartCorrection& start = shape.start_correction();
    if (start.let_out_edges() > 0) {
      char change[128];
      std::snprintf(change, sizeof(change),
                    ": starts outside its colliders, %u edges let out by up to %.2g %%\n",
                    start.let_out_edges(), 100 * start.largest_let_out());
      lines += name + change;
    }
    if (shape.has_elastic_limit()) {
      lines += name + ": " + LimitText(shape.elastic_limit()) + "\n";
    }
  }
  return lines;
}

std::string FaultLines(const RunReport& report) {
  std::string lines;
  for (size_t k = 0; k < report.cloths().size(); ++k) {
    const std::optional<v1::StepReport>& fault = report.cloths()[k].fault;
    if (!fault) continue;
    lines += report.scene() + ": cloth " + std::to_string(k) + " is faulted after step " +
             std::to_string(fault->step()) + ": " + fault->fault_reason() + "\n";
  }
  return lines;
}

RunSummary Summarise(const RunReport& report) {
  RunSummary summary;
  summary.ms_per_step = report.wall_ms_per_step();
  if (summary.ms_per_step > 0) {
    summary.real_time_factor = report.time_step_s() * 1e3 / summary.ms_per_step;
  }
  double strain_sq_sum = 0;
  for (const ClothReport& cloth : report.cloths()) {
    ++summary.cloths;
    summary.particles += cloth.shape.particles();
    summary.constraints += cloth.shape.distance_constraints();
    summary.colours = std::max(summary.colours, cloth.shape.colours());
    for (const v1::StepReport& sample : cloth.samples) {
      summary.max_strain = std::max(summary.max_strain, sample.max_strain());
    }
    if (cloth.samples.empty()) continue;
    const v1::StepReport& last = cloth.samples.back();
    strain_sq_sum += cloth.shape.distance_constraints() * last.rms_strain() * last.rms_strain();
    summary.contacts += last.contacts();
    summary.faulted += cloth.fault ? 1 : 0;
  }
  if (summary.constraints > 0) {
    summary.rms_strain = std::sqrt(strain_sq_sum / static_cast<double>(summary.constraints));
  }
  return summary;
}

std::string SummaryTable(const std::vector<RunReport>& reports) {
  size_t widest = 5;
  for (const RunReport& report : reports) widest = std::max(widest, report.scene().size());
  const int name_width = static_cast<int>(widest);
  char line[512];
  std::snprintf(line, sizeof(line), "%-*s  %-9s %6s %9s %11s %7s %11s %9s %10s %10s %8s\n",
                name_width, "scene", "backend", "cloths", "particles", "constraints", "colours",
                "ms per step", "real time", "max strain", "RMS strain", "contacts");
  std::string table = line;
  for (const RunReport& report : reports) {
    const RunSummary summary = Summarise(report);
    std::snprintf(line, sizeof(line),
                  "%-*s  %-9s %6lu %9lu %11lu %7u %11.3f %8.2fx %8.3f %% %8.4f %% %8lu%s\n",
                  name_width, report.scene().c_str(), report.backend().c_str(), summary.cloths,
                  summary.particles, summary.constraints, summary.colours, summary.ms_per_step,
                  summary.real_time_factor, summary.max_strain * 100, summary.rms_strain * 100,
                  summary.contacts, summary.faulted > 0 ? "  FAULTED" : "");
    table += line;
  }
  return table;
}

}  // namespace drape::cli
