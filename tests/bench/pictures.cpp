// Pictures by the renderer alone, without requests: small ones of many cloths (tiles) beside as
// many pictures one by one, cheaper ones, parts of the work left out, and large ones ->
// pictures.csv.
#include <sys/resource.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "server/core/check.h"
#include "server/core/heap.h"
#include "server/render/gl_draw/gl_renderer.h"
#include "server/render/tiles.h"
#include "shaders/embedded_shaders.h"
#include "tests/bench/bench_scenes.h"
#include "tests/bench/quantiles.h"
#include "tests/bench/subcommands.h"

namespace drape::bench {
namespace {

namespace fs = std::filesystem;
using render::DrawnCloth;
using render::DrawnStates;
using render::PictureSpec;

// Cloths with their states as a backend on the cores gives them.
struct Stage {
  std::string name;
  std::vector<DrawnCloth> cloths;
  DrawnStates states;
  render::Camera camera;
};

Stage MakeStage(Backend& backend, std::string name, const test::Scene& start, uint32_t count,
                uint32_t steps, const render::Camera& camera) {
  Stage stage{.name = std::move(name), .cloths = {}, .states = {}, .camera = camera};
  const ClothBatch batch = MakeBatch(start, count);
  std::vector<ClothHandle> handles;
  std::vector<StepItem> items;
  for (const Eigen::Vector3d& gravity_m_per_s2 : batch.gravities_m_per_s2) {
    test::Scene scene = batch.scene;
    scene.parameters.gravity_m_per_s2 = gravity_m_per_s2;
    handles.push_back(test::CreateCloth(backend, scene));
    items.push_back({handles.back(), {}, false});
    stage.cloths.push_back({scene.model, {}, scene.parameters.colliders});
  }
  for (uint32_t step = 0; step < steps; ++step) backend.Step(items);
  stage.states.host = backend.Read({handles});
  for (const ClothHandle handle : handles) backend.Destroy(handle);
  return stage;
}

double CpuTime_ms() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto ms = [](const timeval& time) {
    return 1e3 * static_cast<double>(time.tv_sec) + 1e-3 * static_cast<double>(time.tv_usec);
  };
  return ms(usage.ru_utime) + ms(usage.ru_stime);
}

// A part of the work that is left out: a change of the product's shaders.
struct ShaderChange {
  std::string file;
  std::string from;
  std::string to;
};
struct Part {
  std::string name;
  std::vector<ShaderChange> changes;
};

const std::vector<Part>& Parts() {
  const std::string place = "gl_Position = frame.clip_from_world * vec4(position, 1.0)";
  const std::string nowhere = "gl_Position = vec4(2.0, 2.0, 2.0, 1.0)";
  static const std::vector<Part> parts = {
      {"all of it", {}},
      {"without normals",
       {{"draw/shade_vertices.comp", "SmoothNormal(cloth, particle, p) :", "vec3(0, 1, 0) :"}}},
      {"without light",
       {{"draw/light_particles.comp", "if (particle >= cloth.particle_count) return;",
         "if (particle >= 0u) return;"}}},
      {"without cloths",
       {{"draw/cloth.vert", place, nowhere}, {"draw/lit_cloth.vert", place, nowhere}}}};
  return parts;
}

std::string Changed(const ShaderChange& change) {
  for (const EmbeddedShader& shader : EmbeddedShaders()) {
    if (shader.path != change.file) continue;
    std::string text(shader.text);
    const size_t at = text.find(change.from);
    DRAPE_CHECK(at != std::string::npos, change.file + " has changed");
    return text.replace(at, change.from.size(), change.to);
  }
  DRAPE_CHECK(false, change.file + " is no shader");
  return {};
}

std::unique_ptr<render::Renderer> MakeRenderer(const Part& part, const fs::path& folder) {
  render::GlRendererOptions options;
  for (const ShaderChange& change : part.changes) {
    fs::create_directories((folder / change.file).parent_path());
    std::ofstream(folder / change.file) << Changed(change);
    options.shader_dir = folder.string();
  }
  auto renderer = render::CreateGlRenderer(options);
  DRAPE_CHECK(renderer.ok(), renderer.status().ToString());
  fs::remove_all(folder);
  return std::move(*renderer);
}

struct Row {
  std::string way;
  const Stage* stage = nullptr;
  render::Renderer* renderer = nullptr;
  PictureSpec spec;
  bool is_alone = false;  // each cloth by a call of its own
  std::vector<double> wall_ms{};
  std::vector<double> cpu_ms{};
};

void DrawCloths(Row& row, std::span<const DrawnCloth> cloths, DrawnStates& states) {
  const auto picture =
      row.spec.is_tiled ? DrawTiles(*row.renderer, row.spec, cloths, states, [] { return false; })
                        : row.renderer->Draw(row.spec, cloths, states);
  DRAPE_CHECK(picture.ok(), picture.status().ToString());
}

void Draw(Row& row) {
  DrawnStates states = row.stage->states;
  const double cpu_ms = CpuTime_ms();
  const auto start = std::chrono::steady_clock::now();
  if (row.is_alone) {
    for (const DrawnCloth& cloth : row.stage->cloths) {
      DrawCloths(row, {&cloth, 1}, states);
      states.first_row += cloth.model->particle_count();
    }
  } else {
    DrawCloths(row, row.stage->cloths, states);
  }
  const std::chrono::duration<double, std::milli> wall = std::chrono::steady_clock::now() - start;
  row.wall_ms.push_back(wall.count());
  row.cpu_ms.push_back(CpuTime_ms() - cpu_ms);
}

// The sheets of the benchmarks: hung, lying on a ball over a floor, and large pictures of one.
struct Stages {
  std::vector<Stage> tiled;
  std::vector<Stage> alone;
};

Stages MakeStages(Bench& bench, uint32_t tiles) {
  Backend& backend = *bench.fast_backend().backend;
  const StepSettings realtime = SettingsOf("REALTIME");
  // The cloth fills about a third of the picture.
  const render::Camera before{.eye_m = {0.5, 0.8, 2.2}, .target_m = {0.5, -0.4, 0.5}};
  const render::Camera above{.eye_m = {0.6, 2.2, 2.4}, .target_m = {0.5, 0.2, 0.5}};
  test::Scene on_ball = test::FallingOnSphere(32);
  on_ball.parameters.settings = realtime;
  Stages stages;
  const test::Scene sheet = Sheet(1024, Pins::kCorners, realtime);
  stages.tiled.push_back(MakeStage(backend, "hung", sheet, tiles, 30, before));
  stages.tiled.push_back(MakeStage(backend, "on a ball", on_ball, tiles, 60, above));
  stages.alone.push_back(MakeStage(backend, "1024 particles", sheet, 1, 30, before));
  const uint32_t many = bench.is_quick() ? 64 : 65536;
  stages.alone.push_back(MakeStage(backend, std::to_string(many) + " particles",
                                   Sheet(many, Pins::kCorners, realtime), 1, 10, before));
  return stages;
}

std::vector<Row> MakeRows(const Stages& stages, uint32_t edge_px,
                          std::span<const std::unique_ptr<render::Renderer>> renderers) {
  std::vector<Row> rows;
  for (const Stage& stage : stages.tiled) {
    PictureSpec spec;
    spec.width_px = spec.height_px = edge_px;
    spec.camera = stage.camera;
    spec.is_raw = true;
    render::Renderer* all = renderers[0].get();
    spec.has_depths = true;
    rows.push_back({"one by one with depths", &stage, all, spec, true});
    spec.is_tiled = true;
    rows.push_back({"tiles with depths", &stage, all, spec});
    for (size_t k = 1; k < renderers.size(); ++k) {
      rows.push_back({Parts()[k].name, &stage, renderers[k].get(), spec});
    }
    PictureSpec cheaper = spec;
    cheaper.has_shadows = false;
    rows.push_back({"without shadows", &stage, all, cheaper});
    cheaper.samples = 1;
    rows.push_back({"one sample without shadows", &stage, all, cheaper});
    cheaper.has_shadows = true;
    rows.push_back({"one sample", &stage, all, cheaper});
    spec.has_depths = false;
    rows.push_back({"tiles", &stage, all, spec});
  }
  for (const Stage& stage : stages.alone) {
    PictureSpec spec;
    spec.camera = stage.camera;
    rows.push_back({"one picture", &stage, renderers[0].get(), spec});
  }
  return rows;
}

}  // namespace

void MeasurePictures(Bench& bench, PicturesOptions options) {
  if (bench.is_quick()) options = {.tiles = 4, .edge_px = 32, .rounds = 2};
  KeepFreedMemory();  // as draped does; it counts for software renderers
  const Stages stages = MakeStages(bench, options.tiles);
  std::vector<std::unique_ptr<render::Renderer>> renderers;
  for (const Part& part : Parts()) {
    renderers.push_back(MakeRenderer(part, bench.out() / "changed_shaders"));
  }
  std::vector<Row> rows = MakeRows(stages, options.edge_px, renderers);
  for (Row& row : rows) Draw(row);  // warm-up
  for (Row& row : rows) row.wall_ms = row.cpu_ms = {};
  for (uint32_t round = 0; round < options.rounds; ++round) {
    for (Row& row : rows) Draw(row);
  }
  Table table = bench.OpenTable("pictures", {"scene", "way", "pictures", "width_px", "height_px",
                                             "rounds", "p10_ms", "median_ms", "p90_ms", "cpu_ms"});
  for (const Row& row : rows) {
    const size_t pictures = row.is_alone || row.spec.is_tiled ? row.stage->cloths.size() : 1;
    const double median_ms = Quantile(row.wall_ms, 0.5), cpu_ms = Quantile(row.cpu_ms, 0.5);
    table.Add({row.stage->name, row.way, pictures, row.spec.width_px, row.spec.height_px,
               options.rounds, Quantile(row.wall_ms, 0.1), median_ms, Quantile(row.wall_ms, 0.9),
               cpu_ms});
    std::printf("  %-16s %-28s %8.1f ms, %8.1f ms of the processor\n", row.stage->name.c_str(),
                row.way.c_str(), median_ms, cpu_ms);
  }
}

}  // namespace drape::bench
