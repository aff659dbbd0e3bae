// drape demo: several scenes through one private server, a table, the final states as geometry and
// pictures.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/commands.h"
#include "client/cli/options.h"
#include "client/cli/progress.h"
#include "client/cli/run_scene.h"
#include "drape/scene_file.h"

namespace drape::cli {
namespace {

namespace fs = std::filesystem;

// Interval of measuring strain and contacts.
constexpr uint64_t kEvery = 10;

struct DemoOptions {
  ServerOptions server;
  std::vector<std::string> scenes = {"client/examples"};
  std::string folder = "out/demo";
  double duration_s = 2;
};

// The named scene files, and those in the named folders, by name.
std::vector<fs::path> SceneFiles(const std::vector<std::string>& names) {
  std::vector<fs::path> files;
  for (const std::string& name : names) {
    if (!fs::is_directory(name)) {
      files.emplace_back(name);
      continue;
    }
    std::vector<fs::path> found;
    for (const auto& entry : fs::directory_iterator(name)) {
      if (entry.path().extension() == ".json") found.push_back(entry.path());
    }
    std::sort(found.begin(), found.end());
    files.insert(files.end(), found.begin(), found.end());
  }
  return files;
}

int Demo(const DemoOptions& options) {
  const std::vector<fs::path> files = SceneFiles(options.scenes);
  if (files.empty()) throw CLI::ValidationError("--scenes", "there are no scene files");
  fs::create_directories(options.folder);
  const Client client = options.server.Open();
  const v1::ServerInfo info = client.GetServerInfo();
  std::printf("Drape %s at %s, backend %s on %s\n\n", info.version().c_str(),
              client.address().c_str(), info.backend().c_str(), info.device().c_str());

  const InterruptGuard interrupt;
  std::vector<RunReport> reports;
  std::vector<fs::path> written;
  std::optional<Error> cannot_draw;
  for (const fs::path& file : files) {
    v1::Scene scene = LoadScene(file);
    scene.set_duration_s(std::min(scene.duration_s(), options.duration_s));
    RunSinks sinks;
    std::vector<fs::path> geometry;
    for (const char* extension : {".obj", ".ply"}) {
      geometry.push_back(fs::path(options.folder) / (file.stem().string() + extension));
      sinks.writers.push_back(
          MakeStateWriter(geometry.back(), {SceneTopologies(scene), scene.time_step_s()}));
    }
    sinks.pictures = std::make_unique<PictureSink>(
        fs::path(options.folder) / (file.stem().string() + ".png"), /*is_series=*/false,
        v1::RenderRequest(), PictureSink::Need::kIfPossible);
    ProgressBar bar(scene.name(), StepCount(scene), /*is_quiet=*/false);
    sinks.on_step = [&bar](uint64_t done) { bar.Show(done); };
    sinks.should_stop = [&interrupt] { return interrupt.is_interrupted(); };
    reports.push_back(RunScene(client, scene, kEvery, sinks));
    written.insert(written.end(), geometry.begin(), geometry.end());
    const auto& pictures = sinks.pictures->written();
    written.insert(written.end(), pictures.begin(), pictures.end());
    cannot_draw = sinks.pictures->cannot_draw();
    if (interrupt.is_interrupted()) break;
  }
  std::printf("%s\nThe final states%s are in:\n", SummaryTable(reports).c_str(),
              cannot_draw ? "" : " and pictures of them");
  for (const fs::path& path : written) std::printf("  %s\n", path.c_str());
  if (cannot_draw) std::printf("NO PICTURES: %s\n", cannot_draw->what());
  std::string faults;
  for (const RunReport& report : reports) faults += FaultLines(report);
  std::fprintf(stderr, "%s", faults.c_str());
  if (interrupt.is_interrupted()) {
    std::fprintf(stderr, "drape: interrupted\n");
    return kFailed;
  }
  return faults.empty() ? kDone : kFaulted;
}

}  // namespace

void AddDemo(CLI::App& app, Action& action) {
  CLI::App* demo = app.add_subcommand("demo", "Play several scenes and print a table");
  auto options = std::make_shared<DemoOptions>();
  options->server.AddTo(*demo);
  demo->add_option("--scenes", options->scenes,
                   "Scene files, or folders of them (default: client/examples)")
      ->type_name("PATH");
  demo->add_option("--out", options->folder,
                   "Folder for the final states and their pictures (default: out/demo)")
      ->type_name("DIR");
  demo->add_option("--duration", options->duration_s,
                   "Play at most this long of each [s] (default: 2)")
      ->check(CLI::Range(0.0, 1e6))
      ->check(FiniteNumber())
      ->type_name("S");
  demo->callback([options, &action] { action = [options] { return Demo(*options); }; });
}

}  // namespace drape::cli
