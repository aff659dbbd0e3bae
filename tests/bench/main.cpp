// drape_bench: measures this machine; see README.md.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <iostream>

#include "server/core/log.h"
#include "tests/bench/accuracy/accuracy.h"
#include "tests/bench/contact/contact.h"
#include "tests/bench/kernels/dump.h"
#include "tests/bench/speed/speed.h"
#include "tests/bench/stability/stability.h"
#include "tests/bench/subcommands.h"

namespace drape::bench {
namespace {

struct CommandLine {
  BenchOptions bench;
  ClothsOptions cloths;
  ParticlesOptions particles;
  Figure4Options figure_4;
  OrderOptions order;
  AccuracyOptions accuracy;
  StabilityOptions stability;
  BodiesOptions bodies;
  BudgetOptions budget;
  PicturesOptions pictures;
  SpeedOptions speed;
  ContactOptions contact;
  KernelsOptions kernels;
  bool needs_hardware = false;
};

const CLI::IsMember& Presets() {
  static const CLI::IsMember presets({"PAPER", "REALTIME", "ACCURATE"});
  return presets;
}

void AddCommonOptions(CLI::App& app, CommandLine& line) {
  BenchOptions& bench = line.bench;
  app.add_option("--backends", bench.backends, "measured side by side")
      ->delimiter(',')
      ->check(CLI::IsMember({"cpu", "gl", "gl_both_ends", "gl_elimination", "reference"}));
  app.add_flag("--quick", bench.is_quick,
               "small sizes, few repeats: only checks that everything works");
  app.add_option("--machine", bench.machine, "folder of the results; default: processor and GPU");
  app.add_option("--out", bench.out,
                 "default: tests/bench/results/MACHINE; with --quick out/bench-quick/MACHINE");
  app.add_option("--warm-up", bench.limits.warm_up, "steps before the timed ones");
  app.add_option("--steps", bench.limits.steps, "largest number of timed steps per row and backend")
      ->check(CLI::PositiveNumber);
  app.add_option("--min-steps", bench.limits.min_steps, "least number of them")
      ->check(CLI::PositiveNumber);
  app.add_option("--row-s", bench.limits.seconds,
                 "time after which a row times no further step [s]")
      ->check(CLI::PositiveNumber);
  app.add_option("--budget-s", bench.budget_s, "time after which no row begins [s]; 0: no limit")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--commit", bench.commit, "commit to note in machine.json");
  app.add_option("--invoked-as", bench.command, "name of the program to note in machine.json");
}

void AddSteps(CLI::App& app, CommandLine& line) {
  CLI::App* cloths = app.add_subcommand("cloths", "ms per step against the number of cloths");
  cloths->add_option("--counts", line.cloths.counts, "numbers of cloths")->delimiter(',');
  cloths->add_option("--particles", line.cloths.particles, "particles of each cloth")
      ->delimiter(',');
  cloths->add_option("--presets", line.cloths.presets)->delimiter(',')->check(Presets());
  CLI::App* particles = app.add_subcommand("particles", "ms per step against the particles");
  particles->add_option("--particles", line.particles.particles, "particles of the cloth")
      ->delimiter(',');
  particles->add_option("--presets", line.particles.presets)->delimiter(',')->check(Presets());
}

void AddScenes(CLI::App& app, CommandLine& line) {
  CLI::App* figure_4 = app.add_subcommand("figure4", "65 536 particles swing onto a sphere");
  figure_4->add_option("--side", line.figure_4.side, "particles along a side")
      ->check(CLI::Range(2, 1024));
  figure_4->add_option("--duration-s", line.figure_4.duration_s)->check(CLI::PositiveNumber);
  figure_4->add_option("--presets", line.figure_4.presets)->delimiter(',')->check(Presets());
  CLI::App* order = app.add_subcommand("order", "order of the colours against convergence");
  order->add_option("--seeds", line.order.seeds, "shuffles")->check(CLI::Range(1, 10000));
  CLI::App* accuracy = app.add_subcommand(
      "accuracy", "wall time against error: methods x settings x scenes; not part of all");
  accuracy->add_option("--scenes", line.accuracy.scenes, "only these")->delimiter(',');
  accuracy->add_option("--quantities", line.accuracy.quantities, "only these kinds of them")
      ->delimiter(',');
  accuracy->add_option("--method", line.accuracy.methods,
                       "another method, \"NAME: substeps=16 use_tethers=false\"; may be repeated");
  PlayLimits& limits = line.accuracy.limits;
  accuracy->add_option("--repeats", limits.repeats, "largest number of timed plays of a point");
  accuracy->add_option("--point-s", limits.seconds,
                       "time after which a point is not played again [s]");
  accuracy->add_option("--play-s", limits.play_s, "longest play; longer ones are stopped [s]");
  CLI::App* budget =
      app.add_subcommand("budget", "whether steps keep to their frame budgets; not part of all");
  budget->add_option("--budgets-ms", line.budget.budgets_ms)->delimiter(',');
  budget->add_option("--particles", line.budget.particles, "particles of the cloth");
  budget->add_option("--steps", line.budget.steps)->check(CLI::PositiveNumber);
  CLI::App* bodies = app.add_subcommand(
      "bodies", "bodies that touch and hang together, on cpu and reference; not part of all");
  bodies->add_option("--scenes", line.bodies.scenes, "only these")->delimiter(',');
  bodies->add_option("--steps-of-scene", line.bodies.steps, "from the start of each")
      ->check(CLI::PositiveNumber);
  CLI::App* pictures = app.add_subcommand(
      "pictures", "the renderer without requests: tiles, large pictures; not part of all");
  pictures->add_option("--tiles", line.pictures.tiles, "cloths, each in a picture of its own")
      ->check(CLI::Range(1, 1024));
  pictures->add_option("--edge-px", line.pictures.edge_px, "of a tile")
      ->check(CLI::Range(16, 1024));
  pictures->add_option("--rounds", line.pictures.rounds)->check(CLI::PositiveNumber);
  CLI::App* stability = app.add_subcommand(
      "stability", "what survives, recovers, warns, breaks or faults; not part of all");
  stability->add_flag("--full", line.stability.is_full, "every value and switch: takes long");
  stability->add_option("--tables", line.stability.tables, "only these")->delimiter(',');
  stability->add_option("--methods", line.stability.methods, "only these")->delimiter(',');
  stability->add_option("--cell-s", line.stability.cell_s, "time after which a cell is cut [s]")
      ->check(CLI::PositiveNumber);
  CLI::App* kernels = app.add_subcommand(
      "kernels",
      "the kernels of named cloths as a GPU gets them; `./run bench kernels` counts them");
  kernels->add_option("--dump", line.kernels.dump, "folder for them")->required();
  kernels->add_option("--shader-dir", line.kernels.shader_dir,
                      "folder of shaders that replace built-in ones");
  CLI::App* device = app.add_subcommand("device", "the GL device; exit status 3: software");
  device->add_flag("--require-hardware", line.needs_hardware, "fail on a software renderer");
  app.add_subcommand(
      "all",
      "all tables except those of accuracy, bodies, budget, contact, pictures, speed and "
      "stability (the default)");
}

void AddSpeed(CLI::App& app, CommandLine& line) {
  SpeedOptions& options = line.speed;
  CLI::App* speed = app.add_subcommand(
      "speed", "cost of a cloth, against the machine's limits and others; not part of all");
  speed->add_option("--parts", options.parts, "only these")
      ->delimiter(',')
      ->check(CLI::IsMember(std::vector<std::string>(kSpeedParts.begin(), kSpeedParts.end())));
  speed->add_option(
      "--method", options.curve.methods,
      "another setting of the curve, \"NAME: substeps=16 sweep=COLOURS\"; may be repeated");
  speed->add_option("--difference", options.unlike.only,
                    "unlike: only this, \"two grips each\"; may be repeated");
  KernelTimesOptions& kernels = options.kernels;
  speed
      ->add_option("--shader-dirs", kernels.shader_dirs,
                   "kernels: folders of shaders that replace built-in ones, in turn with built_in")
      ->delimiter(',');
  speed->add_option("--cloths", kernels.cloths, "kernels: only these")->delimiter(',');
  speed->add_option("--counts", kernels.counts, "kernels: numbers of cloths")
      ->delimiter(',')
      ->check(CLI::PositiveNumber);
}

void AddContact(CLI::App& app, CommandLine& line) {
  ContactOptions& options = line.contact;
  CLI::App* contact = app.add_subcommand(
      "contact", "what self-collision costs and keeps, on the backend cpu; not part of all");
  contact->add_option("--scenes", options.scenes, "only these")
      ->delimiter(',')
      ->check(CLI::IsMember({"fold", "pile", "twist", "drape", "swing", "nothing"}));
  contact->add_option("--sides", options.sides, "particles along a side")
      ->delimiter(',')
      ->check(CLI::Range(4, 256));
  contact->add_option("--counts", options.counts, "numbers of cloths")
      ->delimiter(',')
      ->check(CLI::PositiveNumber);
  contact->add_option("--substeps", options.substeps)->delimiter(',')->check(CLI::PositiveNumber);
  contact->add_option("--thickness-m", options.thickness_m)->check(CLI::PositiveNumber);
  contact->add_option("--threads", options.threads, "of the backend")->check(CLI::PositiveNumber);
  contact->add_option("--count-crossings", options.positions,
                      "print the crossings in each frame of a file of positions, instead");
}

// The command that repeats the measurement; without options that only describe it.
std::string CommandOf(const std::string& invoked_as, int argc, char** argv) {
  std::string command = invoked_as.empty() ? argv[0] : invoked_as;
  for (int k = 1; k < argc; ++k) {
    const std::string word = argv[k];
    if (word.starts_with("--commit=") || word.starts_with("--invoked-as=")) continue;
    command += " " + word;
  }
  return command;
}

int Run(const CLI::App& app, CommandLine& line) {
  if (app.got_subcommand("device")) return ShowDevice(line.needs_hardware);
  if (app.got_subcommand("kernels")) {
    DumpKernels(line.kernels);
    return 0;
  }
  if (app.got_subcommand("contact") && !line.contact.positions.empty()) {
    return CountCrossings(line.contact.positions, line.contact.sides.front());
  }
  if (line.bench.is_quick) {
    line.bench.limits = {1, 2, 1, 0.1};
    // Never over what was measured.
    line.bench.results_root = "out/bench-quick";
  }
  if (app.got_subcommand("stability")) line.bench.subfolder = "stability";
  Bench bench(line.bench);
  const bool is_all = app.got_subcommand("all") || app.get_subcommands().empty();
  // Whether this part is wanted; in "all" it must leave the rest of the budget to those after it.
  const auto is_wanted = [&](const char* name, double share_of_budget) {
    bench.AllowShare(is_all ? share_of_budget : 1);
    return is_all || app.got_subcommand(name);
  };
  if (is_wanted("cloths", 0.35)) MeasureCloths(bench, line.cloths);
  if (is_wanted("particles", 0.6)) MeasureParticles(bench, line.particles);
  if (is_wanted("figure4", 0.8)) MeasureFigure4(bench, line.figure_4);
  if (is_wanted("order", 1)) MeasureOrder(bench, line.order);
  if (app.got_subcommand("accuracy")) MeasureAccuracy(bench, line.accuracy);
  if (app.got_subcommand("budget")) MeasureBudget(bench, line.budget);
  if (app.got_subcommand("bodies")) MeasureBodies(bench, line.bodies);
  if (app.got_subcommand("pictures")) MeasurePictures(bench, line.pictures);
  if (app.got_subcommand("speed")) MeasureSpeed(bench, line.speed);
  if (app.got_subcommand("contact")) MeasureContact(bench, line.contact);
  if (app.got_subcommand("stability")) MeasureStability(bench, line.stability);
  std::printf("\nresults are in %s\n", bench.out().c_str());
  return 0;
}

}  // namespace
}  // namespace drape::bench

int main(int argc, char** argv) {
  using namespace drape::bench;
  CommandLine line;
  CLI::App app{
      "Measures the time of a step on this machine, the backends side by side, and writes "
      "a CSV file per table."};
  app.set_version_flag("--version", DRAPE_VERSION);
  app.option_defaults()->always_capture_default();
  app.fallthrough();
  app.require_subcommand(0, 1);
  AddCommonOptions(app, line);
  AddSteps(app, line);
  AddScenes(app, line);
  AddSpeed(app, line);
  AddContact(app, line);
  CLI11_PARSE(app, argc, argv);
  line.bench.command = CommandOf(line.bench.command, argc, argv);
  try {
    if (const drape::Status status = drape::InitLog("warn"); !status.ok()) return 1;
    return Run(app, line);
  } catch (const std::exception& error) {
    std::cerr << "drape_bench: " << error.what() << "\n";
    return 1;
  }
}
