// The program as a user runs it, at its smallest: every table with its columns and rows, and the
// script that reads them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "tests/bench/bench_scenes.h"
#include "tests/bench/machine.h"
#include "tests/bench/shell.h"
#include "tests/support/paths/paths.h"

namespace drape::bench {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::SizeIs;
using testing::StartsWith;

// Lines after the one with the columns.
ptrdiff_t RowCount(const fs::path& csv) {
  const std::string text = ReadText(csv);
  return std::count(text.begin(), text.end(), '\n') - 1;
}

class BenchTest : public testing::Test {
 protected:
  Ending Bench(const std::string& arguments) const {
    return RunShell(test::ProgramPath("drape_bench").string() + " " + arguments +
                    " --quick --out=" + out_.string());
  }
  Ending Tables(const std::string& arguments) const {
    return RunShell("python3 -B " + test::SourcePath("tests/bench/tables.py").string() + " " +
                    arguments + out_.string());
  }

  ScratchFolder folder_;
  const fs::path out_ = folder_.path();
};

TEST_F(BenchTest, AllMakesEveryTableAndTheScriptReadsThem) {
  const Ending ending = Bench("all");
  ASSERT_EQ(ending.exit_status, 0) << ending.text;
  constexpr int kBackends = 3;
  EXPECT_EQ(RowCount(out_ / "cloths.csv"), 2 * kBackends);
  EXPECT_EQ(RowCount(out_ / "particles.csv"), 2 * 2 * kBackends);
  EXPECT_EQ(RowCount(out_ / "figure_4_motion.csv"), 6);
  EXPECT_EQ(RowCount(out_ / "figure_4.csv"), kBackends);
  // Scenes x substeps x (nothing, from_pins, towards_pins, 2 seeds of 3 shuffles).
  EXPECT_EQ(RowCount(out_ / "order.csv"), 3 * 2 * (3 + 2 * 3));

  const Ending read = Tables("--check ");
  ASSERT_EQ(read.exit_status, 0) << "python3 is needed (./run test installs it): " << read.text;
  EXPECT_THAT(read.text,
              StartsWith("cloths 6\nparticles 12\nfigure_4 3\nfigure_4_motion 6\norder 54\n"));
  ASSERT_EQ(Tables("").exit_status, 0);
  const std::string readme = ReadText(out_ / "README.md");
  EXPECT_THAT(readme, HasSubstr("drape_bench all --quick"));
  EXPECT_THAT(readme, HasSubstr("| cloths | cpu [ms] | gl [ms] | reference [ms] |"));
  EXPECT_THAT(readme, HasSubstr("- hanging_edge: "));
}

TEST_F(BenchTest, StabilityTriesTheTablesOnEveryBackend) {
  const Ending ending = Bench("stability --methods=REALTIME --tables=load,starts,impact,soak");
  ASSERT_EQ(ending.exit_status, 0) << ending.text;
  const ptrdiff_t cells = RowCount(out_ / "stability.csv");
  EXPECT_GT(cells, 3 * 15);
  EXPECT_EQ(cells % 3, 0) << "the same cells on each backend";
  ASSERT_EQ(Tables("").exit_status, 0);
  const std::string readme = ReadText(out_ / "README.md");
  EXPECT_THAT(readme, HasSubstr("### The bar"));
  EXPECT_THAT(readme, HasSubstr("In none of the " + std::to_string(cells) + " cells"));
  EXPECT_THAT(readme, HasSubstr("`reference`, "));
  const Ending unknown = Bench("stability --tables=weather");
  EXPECT_EQ(unknown.exit_status, 1);
  EXPECT_THAT(unknown.text, HasSubstr("'weather' is none of gravity"));
}

TEST_F(BenchTest, StabilityTriesRandomClothsOnEveryBackend) {
  const Ending ending = Bench("stability --methods=REALTIME --tables=random");
  ASSERT_EQ(ending.exit_status, 0) << ending.text;
  EXPECT_EQ(RowCount(out_ / "stability_random.csv"), 7 * 3);
  EXPECT_FALSE(fs::exists(out_ / "stability.csv"));
  ASSERT_EQ(Tables("").exit_status, 0);
  const std::string readme = ReadText(out_ / "README.md");
  EXPECT_THAT(readme, HasSubstr("`reference`, 7 plays: 0 gain more than"));
  EXPECT_THAT(readme, HasSubstr("| linkage (1 of 0.1 s) |"));
}

TEST_F(BenchTest, BudgetOnEveryBackend) {
  const Ending ending = Bench("budget");
  ASSERT_EQ(ending.exit_status, 0) << ending.text;
  EXPECT_EQ(RowCount(out_ / "budget.csv"), 3);
  ASSERT_EQ(Tables("").exit_status, 0);
  EXPECT_THAT(ReadText(out_ / "README.md"), HasSubstr("| cpu, 1 ms |"));
}

TEST_F(BenchTest, BodiesOfEveryScene) {
  const Ending ending = Bench("bodies");
  ASSERT_EQ(ending.exit_status, 0) << ending.text;
  EXPECT_EQ(RowCount(out_ / "bodies.csv"), 10 * 2);
  ASSERT_EQ(Tables("").exit_status, 0);
  EXPECT_THAT(ReadText(out_ / "README.md"), HasSubstr("| lattice_16 | cpu | 16 | 128 |"));
}

TEST_F(BenchTest, PicturesOfEveryWay) {
  const Ending ending = Bench("pictures --backends=cpu");
  ASSERT_EQ(ending.exit_status, 0) << ending.text;
  EXPECT_EQ(RowCount(out_ / "pictures.csv"), 2 * 9 + 2);
  EXPECT_FALSE(fs::exists(out_ / "changed_shaders"));
  ASSERT_EQ(Tables("").exit_status, 0);
  EXPECT_THAT(ReadText(out_ / "README.md"), HasSubstr("| hung | tiles with depths | 4 | 32×32 |"));
}

TEST_F(BenchTest, SpeedMakesItsTables) {
  const Ending ending = Bench("speed");
  ASSERT_EQ(ending.exit_status, 0) << ending.text;
  const ptrdiff_t thread_counts = std::thread::hardware_concurrency() > 1 ? 2 : 1;
  // Copies in two caches and four operations on the cpu, three limits of gl.
  EXPECT_EQ(RowCount(out_ / "speed_limits.csv"), thread_counts * 6 + 3);
  // Cloths: three presets, lanes and single with one thread and all, and gl; then two sizes of one
  // cloth, with one thread and all, and gl.
  EXPECT_EQ(RowCount(out_ / "speed_cost.csv"),
            3 * (thread_counts * 2 + 1) + 2 * (thread_counts + 1));
  EXPECT_EQ(RowCount(out_ / "speed_flatness.csv"), 2 * 2 * 2);  // sizes and rounds
  EXPECT_EQ(RowCount(out_ / "speed_curve.csv"), 5);
  // Loads; what answers say; one request at a time by both calls and two under way.
  EXPECT_EQ(RowCount(out_ / "speed_service.csv"), 2 * 3 * 3);
  EXPECT_EQ(RowCount(out_ / "speed_unlike.csv"), 13);
  EXPECT_EQ(RowCount(out_ / "speed_fabrics.csv"), 2 * (4 + 2 * 3));  // counts; sheets, garments
  EXPECT_EQ(RowCount(out_ / "speed_skips.csv"), 17 + 6);             // and on gl
  EXPECT_THAT(ReadText(out_ / "speed_skips.csv"), HasSubstr("sleep: all at rest on the ground,"));
  ASSERT_EQ(Tables("").exit_status, 0);
  const std::string readme = ReadText(out_ / "README.md");
  EXPECT_THAT(readme, HasSubstr("### The machine's limits"));
  EXPECT_THAT(readme, HasSubstr("single / lanes"));
  EXPECT_THAT(readme, HasSubstr("| box and capsule that move with friction | 36 |"));
  EXPECT_THAT(readme, HasSubstr("| irregular shirt that bends | "));
  EXPECT_THAT(readme, HasSubstr("has NOT measured"));
  EXPECT_THAT(readme, HasSubstr("| Bullet 1x10 |"));
  EXPECT_THAT(readme, HasSubstr("| 2 × 1, positions, StepStream two under way |"));
  EXPECT_THAT(readme, HasSubstr("| 2 × 1, corners, Step one at a time |"));
}

TEST_F(BenchTest, APartOfSpeedAndASettingOfOnesOwn) {
  const Ending ending =
      Bench("speed --parts=curve --backends=cpu --method=\"mine: substeps=3 sweep=COLOURS\"");
  ASSERT_EQ(ending.exit_status, 0) << ending.text;
  EXPECT_FALSE(fs::exists(out_ / "speed_cost.csv"));
  EXPECT_THAT(ReadText(out_ / "speed_curve.csv"), HasSubstr("cpu,mine,mine,"));
  const Ending unknown = Bench("speed --parts=weather");
  EXPECT_NE(unknown.exit_status, 0);
  EXPECT_THAT(unknown.text, HasSubstr("weather"));
}

TEST_F(BenchTest, ADifferenceAloneAndOneThatIsUnknownLosesNothing) {
  const Ending ending = Bench("speed --parts=unlike --difference='two grips each'");
  ASSERT_EQ(ending.exit_status, 0) << ending.text;
  EXPECT_EQ(RowCount(out_ / "speed_unlike.csv"), 1);
  const Ending unknown = Bench("speed --parts=unlike --difference=weather");
  EXPECT_NE(unknown.exit_status, 0);
  EXPECT_THAT(unknown.text, HasSubstr("'weather' is none of"));
  EXPECT_THAT(unknown.text, HasSubstr("impulses of two grips each"));
  EXPECT_EQ(RowCount(out_ / "speed_unlike.csv"), 1);
}

TEST_F(BenchTest, LocalSizesInTurn) {
  const Ending ending = Bench("speed --parts=local_sizes --backends=gl");
  ASSERT_EQ(ending.exit_status, 0) << ending.text;
  // Two sizes of a resident and of a tiled cloth, and of the group that refines the tiled one.
  EXPECT_EQ(RowCount(out_ / "speed_local_sizes.csv"), 3 * 2);
  EXPECT_EQ(RowCount(out_ / "speed_packing.csv"), 2 * 2);
  EXPECT_THAT(ReadText(out_ / "speed_local_sizes.csv"), HasSubstr("REALTIME,tiled,refine,1,1089,"));
  ASSERT_EQ(Tables("").exit_status, 0);
  const std::string readme = ReadText(out_ / "README.md");
  EXPECT_THAT(readme, HasSubstr("### Local sizes"));
  EXPECT_THAT(readme, HasSubstr("| REALTIME, 1 × 1089, tiled, the group that refines |"));
  EXPECT_THAT(readme, HasSubstr("| 16 particles, 2 per group |"));
}

TEST_F(BenchTest, KernelsInTurnWithThoseOfAFolder) {
  const std::string folder = out_ / "shaders_of_a_change";
  fs::create_directories(folder + "/lib");
  fs::copy_file(test::SourcePath("shaders/lib/tether.glsl"), folder + "/lib/tether.glsl");
  const std::string part = "speed --parts=kernels --backends=gl --cloths=";
  const Ending ending = Bench(part + "small,mesh --shader-dirs=built_in," + folder);
  ASSERT_EQ(ending.exit_status, 0) << ending.text;
  EXPECT_EQ(RowCount(out_ / "speed_kernels.csv"), 2 * 2);
  EXPECT_THAT(ReadText(out_ / "speed_kernels.csv"), HasSubstr("small," + folder + ",1,64,1,"));
  ASSERT_EQ(Tables("").exit_status, 0);
  EXPECT_THAT(ReadText(out_ / "README.md"),
              HasSubstr("| cloths | particles of each | built_in | "));
  const Ending unknown = Bench(part + "smal");
  EXPECT_NE(unknown.exit_status, 0);
  EXPECT_THAT(unknown.text, HasSubstr("no cloth is called 'smal'; there are two_corners "));
}

// nvcloth.py needs NvCloth, which tests do not install; the rows that it writes are read.
TEST_F(BenchTest, NvClothBesideTheCurve) {
  ASSERT_EQ(Bench("speed --parts=curve --backends=cpu").exit_status, 0);
  std::ofstream(out_ / "speed_nvcloth.csv")
      << "program,build,has_tethers,iterations,cloths,us_one_thread,max_strain,rms_strain\n"
         "NvCloth x,GCC y,1,5,64,1e9,1e9,1e9\n"
         "NvCloth x,GCC y,0,20,64,1e9,0,0\n"
         "NvCloth x,GCC y,1,5,1,1,0.05,0.007\n"
         "NvCloth x,GCC y,0,20,1,1,0.09,0.004\n";
  ASSERT_EQ(Tables("").exit_status, 0);
  const std::string readme = ReadText(out_ / "README.md");
  EXPECT_THAT(readme, ContainsRegex("5 iterations, tethers: 1000000000 µs \\|.*\\| 5 % / 0.7 % "
                                    "\\| [^|]* \\| [^|]* \\| [^|]* \\| yes \\|"));
  EXPECT_THAT(readme, ContainsRegex("\n\\| 20 iterations: .*\\| no setting \\|.*\\| NO \\|"));
  EXPECT_THAT(readme, HasSubstr("has NOT measured"));
}

// As gpu_round.sh does it: the parts that were measured are read without the others.
TEST_F(BenchTest, PartsOfSpeedOneByOne) {
  for (const char* part : {"limits", "cost"}) {
    const Ending ending = Bench("speed --backends=cpu,gl --parts=" + std::string(part));
    ASSERT_EQ(ending.exit_status, 0) << ending.text;
    const Ending read = Tables("");
    EXPECT_EQ(read.exit_status, 0) << part << ": " << read.text;
  }
  EXPECT_THAT(ReadText(out_ / "README.md"), HasSubstr("### What a step costs"));
}

// Drawing needs matplotlib and the peers are other programs, which tests do not install: here only
// that it is Python.
TEST_F(BenchTest, TheOtherScriptsAreValidPython) {
  for (const char* script :
       {"tests/bench/plots.py", "tests/bench/accuracy_plots.py", "tests/bench/peers.py",
        "tests/bench/nvcloth.py", "tests/bench/speed_plots.py", "tests/bench/stability_plots.py"}) {
    const Ending parsed =
        RunShell("python3 -B -c 'import ast, sys; ast.parse(open(sys.argv[1]).read())' " +
                 test::SourcePath(script).string());
    EXPECT_EQ(parsed.exit_status, 0) << script << ": " << parsed.text;
  }
}

TEST_F(BenchTest, OneTableAfterTheOtherIntoOneFolder) {
  const Ending first = Bench("cloths --backends=cpu --machine=desk --commit=abc");
  ASSERT_EQ(first.exit_status, 0) << first.text;
  const Ending second = Bench("order --seeds=3 --backends=cpu --machine=desk");
  ASSERT_EQ(second.exit_status, 0) << second.text;
  const Json machine = Json::parse(ReadText(out_ / "machine.json"));
  EXPECT_EQ(machine["machine"], "desk");
  EXPECT_EQ(machine["gl"], "");
  EXPECT_THAT(machine["tables"], SizeIs(2));
  EXPECT_EQ(machine["tables"]["cloths"]["commit"], "abc");
  EXPECT_THAT(machine["tables"]["order"]["command"].get<std::string>(), HasSubstr("--seeds=3"));
  EXPECT_GE(machine["cores"], 1);
}

TEST_F(BenchTest, ATableOfOtherColumnsIsRefusedByName) {
  ASSERT_EQ(Bench("cloths --backends=cpu").exit_status, 0);
  std::ofstream(out_ / "order.csv") << "scene,sweeps\nx,1\n";
  const Ending read = Tables("--check ");
  EXPECT_NE(read.exit_status, 0);
  EXPECT_THAT(read.text, HasSubstr("order.csv: columns ['scene', 'sweeps']"));
}

TEST_F(BenchTest, ABudgetThatIsUsedUpLeavesRowsOutAndSaysSo) {
  const Ending ending = Bench("all --backends=cpu --budget-s=0.000001");
  ASSERT_EQ(ending.exit_status, 0) << ending.text;
  EXPECT_THAT(ending.text, HasSubstr("left out"));
  EXPECT_EQ(RowCount(out_ / "cloths.csv"), 0);
  EXPECT_EQ(RowCount(out_ / "order.csv"), 0);
}

TEST_F(BenchTest, WrongArgumentsAreNamed) {
  EXPECT_THAT(Bench("cloths --presets=FAST").text, HasSubstr("FAST"));
  EXPECT_NE(Bench("nonsense").exit_status, 0);
  const Ending unwritable = RunShell(test::ProgramPath("drape_bench").string() +
                                     " cloths --quick --backends=cpu --out=/dev/null/x");
  EXPECT_EQ(unwritable.exit_status, 1);
  EXPECT_THAT(unwritable.text, HasSubstr("cannot make --out /dev/null/x"));
}

TEST_F(BenchTest, DeviceTellsSoftwareFromHardware) {
  const std::string device = test::ProgramPath("drape_bench").string() + " device";
  const Ending any = RunShell(device);
  ASSERT_EQ(any.exit_status, 0) << any.text;
  EXPECT_THAT(any.text, HasSubstr("renderer: "));
  const bool is_software = any.text.find("kind: software") != std::string::npos;
  EXPECT_EQ(RunShell(device + " --require-hardware").exit_status, is_software ? 3 : 0);
}

// scenes/figure_4.json is for `drape run`; the benchmark must mean the same scene.
TEST(Figure4Test, TheSceneFileIsTheSceneOfTheBenchmark) {
  const Json file = Json::parse(ReadText(test::SourcePath("tests/bench/scenes/figure_4.json")));
  const Json& spec = file["cloths"][0]["spec"];
  const test::Scene scene = Figure4(256, PresetSettings(Preset::kRealtime));
  const SceneModel& model = *scene.model;
  const Json& grid = spec["grid"];
  EXPECT_EQ(grid["columns"].get<uint32_t>() * grid["rows"].get<uint32_t>(), model.particle_count());
  const Eigen::Vector3d far_corner(grid["width_m"], 0, grid["height_m"]);
  EXPECT_EQ(model.rest_positions_m().back(), far_corner);
  ASSERT_THAT(spec["pins"], SizeIs(model.pin_count()));
  for (uint32_t k = 0; k < model.pin_count(); ++k) {
    EXPECT_EQ(spec["pins"][k]["particle"], model.pins()[k]);
  }
  const Json& material = spec["material"];
  EXPECT_EQ(material["damping_per_s"], scene.parameters.damping_per_s);
  EXPECT_EQ(material["friction_static"], scene.parameters.friction_static);
  EXPECT_EQ(material["friction_dynamic"], scene.parameters.friction_dynamic);
  ASSERT_THAT(spec["environment"]["colliders"], SizeIs(scene.parameters.colliders.size()));
  const Json& sphere = spec["environment"]["colliders"][0]["sphere"];
  const Collider& expected = scene.parameters.colliders[0];
  EXPECT_EQ(Eigen::Vector3d(sphere["center_m"][0], sphere["center_m"][1], sphere["center_m"][2]),
            expected.pose.position_m);
  EXPECT_EQ(sphere["radius_m"], std::get<SphereShape>(expected.shape).radius_m);
}

TEST(MachineTest, ProcessorsOfOneNameAreToldApart) {
  EXPECT_EQ(ProcessorName("AMD EPYC", "25", "17"), "AMD EPYC, family 25 model 17");
  EXPECT_EQ(ProcessorName("AMD EPYC 9654 96-Core Processor", "25", "17"),
            "AMD EPYC 9654 96-Core Processor");
  EXPECT_EQ(ProcessorName("Cortex", "", ""), "Cortex");
  EXPECT_EQ(ProcessorName("", "6", "1"), "unknown processor");
}

TEST(MachineTest, NamesAreFolders) {
  EXPECT_EQ(Slug("Intel(R) Xeon(R) @ 2.50GHz"), "intel-r-xeon-r-2-50ghz");
  EXPECT_EQ(
      MachineName(
          {.cpu = "AMD EPYC", .cores = 2, .instruction_sets = {}, .compiler = "", .flags = ""}, ""),
      "amd-epyc-2-cores");
  EXPECT_EQ(
      MachineName({.cpu = "A", .cores = 1, .instruction_sets = {}, .compiler = "", .flags = ""},
                  "NVIDIA X/PCIe"),
      "a-1-core-nvidia-x-pcie");
}

}  // namespace
}  // namespace drape::bench
