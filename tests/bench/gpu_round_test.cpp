// The script for a GPU machine, with a pack of shell scripts: which parts count as passed, which
// files are kept, and the exit status. Only such a machine can show that the carried libraries
// suffice.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "tests/bench/shell.h"
#include "tests/support/paths/paths.h"

namespace drape::bench {
namespace {

namespace fs = std::filesystem;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

constexpr char kPasses[] = "echo '[       OK ] A.b (0 ms)'";

class GpuRoundTest : public testing::Test {
 protected:
  GpuRoundTest() {
    WriteFile(pack_ / "COMMIT", "abc1234\n");
    WriteFile(pack_ / "GLIBC", "2.0\n");
    fs::create_directory(pack_ / "lib-if-missing");
    for (const char* suite : {"gl_test", "parity_test", "stability_test"}) Program(suite, kPasses);
    Program("drape", "exit 0");
    Program("drape_bench", "echo 'kind: hardware'");
  }

  void Program(const std::string& name, const std::string& script) const {
    const fs::path path = pack_ / "bin" / name;
    WriteFile(path, "#!/bin/sh\n" + script + "\n");
    chmod(path.c_str(), 0755);
  }

  Ending Run(const std::string& options = "", const std::string& environment = "") const {
    return RunShell(environment + test::SourcePath("tests/bench/gpu_round.sh").string() + " run " +
                    pack_.string() + " " + out_.string() + " " + options);
  }
  std::string Summary() const { return ReadText(out_ / "summary.txt"); }
  // The names of the files in results.tar.gz.
  std::string Packed() const {
    return RunShell("tar -tzf " + (out_ / "results.tar.gz").string()).text;
  }

  ScratchFolder folder_;
  fs::path pack_ = folder_.path() / "pack";
  fs::path out_ = folder_.path() / "out";
};

TEST_F(GpuRoundTest, AllPassed) {
  const Ending ending = Run();
  EXPECT_EQ(ending.exit_status, 0) << ending.text;
  EXPECT_THAT(Summary(), HasSubstr("Drape abc1234"));
  EXPECT_THAT(Summary(), ContainsRegex("parity_0 +passed +[0-9]+ s +1 ok, 0 failed"));
  EXPECT_THAT(Summary(), HasSubstr("all parts passed"));
  EXPECT_THAT(Packed(), HasSubstr("log/parity_0.log"));
  EXPECT_THAT(Summary(), Not(HasSubstr("physics"))) << "a suite that was not packed is left out";
}

TEST_F(GpuRoundTest, AFailedSuiteIsToldAndTheRestRuns) {
  Program("parity_test", "echo '[  FAILED  ] A.c (3 ms)'; exit 1");
  Program("gl_test", "kill -SEGV $$");
  const Ending ending = Run();
  EXPECT_EQ(ending.exit_status, 1) << ending.text;
  EXPECT_THAT(Summary(), ContainsRegex("gl +FAILED"));
  EXPECT_THAT(Summary(), ContainsRegex("parity_3 +FAILED \\(1\\) +[0-9]+ s +0 ok, 1 failed"));
  EXPECT_THAT(Summary(), ContainsRegex("stability_1 +passed"));
  // Smoke of both, the suite gl, four shards of parity.
  EXPECT_THAT(Summary(), HasSubstr("7 PARTS FAILED"));
}

TEST_F(GpuRoundTest, ABenchmarkThatFailsIsToldButIsNoFailedTest) {
  Program("drape_bench", "[ \"$1\" = device ] || exit 1");
  EXPECT_EQ(Run().exit_status, 0);
  EXPECT_THAT(Summary(), ContainsRegex("bench +FAILED \\(1\\)"));
}

// Each part of `speed` for itself, before `all`, into the same folder, which is kept.
TEST_F(GpuRoundTest, SpeedIsMeasuredPartByPart) {
  const fs::path calls = folder_.path() / "calls";
  Program("drape_bench",
          "echo \"$@\" >>" + calls.string() +
              "; [ \"$1\" != speed ] || "
              "echo row >\"$(echo \"$*\" | sed 's/.*--out=\\([^ ]*\\).*/\\1/')/$2.csv\"");
  const Ending ending = Run("--speed-s=50");
  ASSERT_EQ(ending.exit_status, 0) << ending.text;
  std::string last = "device ";
  for (const auto& [part, budget_s] : {std::pair{"kernels", "10"},
                                       {"cost", "15"},
                                       {"limits", "3"},
                                       {"local_sizes", "13"},
                                       {"skips", "3"},
                                       {"curve", "5"},
                                       {"service", "3"}}) {
    const std::string call = std::string("speed --parts=") + part + " ";
    EXPECT_THAT(ReadText(calls), ContainsRegex(last + ".*\n" + call));
    EXPECT_THAT(ReadText(calls), ContainsRegex(call + ".*--budget-s=" + budget_s + " "));
    EXPECT_THAT(Summary(), ContainsRegex(std::string("speed_") + part + " +passed"));
    EXPECT_THAT(Packed(), HasSubstr(std::string("bench/--parts=") + part + ".csv"));
    last = call;
  }
  EXPECT_THAT(ReadText(calls),
              HasSubstr("--parts=cost --backends=cpu,gl,gl_both_ends,gl_elimination "));
  EXPECT_THAT(ReadText(calls), ContainsRegex(last + ".*\nall "));
}

// A suite that fails must not cost what only the machine with the GPU can give.
TEST_F(GpuRoundTest, SmokeThenBenchmarksThenSuitesInShards) {
  const fs::path calls = folder_.path() / "calls";
  const std::string note =
      "echo \"$(basename \"$0\") $GTEST_SHARD_INDEX/$GTEST_TOTAL_SHARDS $*\" >>" + calls.string() +
      "; " + kPasses;
  for (const char* program : {"parity_test", "gl_test", "drape_bench"}) Program(program, note);
  const Ending ending = Run();
  ASSERT_EQ(ending.exit_status, 0) << ending.text;
  const std::string text = ReadText(calls);
  EXPECT_LT(text.find("parity_test / --gtest_filter=StripHalvesTest"), text.find(" speed "));
  EXPECT_LT(text.find("drape_bench / all "), text.find("parity_test 0/4"));
  for (int shard = 0; shard < 4; ++shard) {
    EXPECT_THAT(text, HasSubstr("parity_test " + std::to_string(shard) + "/4 "));
    EXPECT_THAT(Summary(), ContainsRegex("parity_" + std::to_string(shard) + " +passed"));
  }
  EXPECT_THAT(text, HasSubstr("gl_test 0/1 "));
}

// `ldconfig -p | grep -q` under pipefail is wrong as soon as ldconfig still writes when grep has
// found its line.
TEST_F(GpuRoundTest, LibrariesOfTheMachineComeBeforeTheCarriedOnes) {
  for (const char* name : {"libz.so.1", "libcarried.so.2"}) {
    WriteFile(pack_ / "lib-if-missing" / name, "");
  }
  const fs::path tools = folder_.path() / "tools";
  WriteFile(tools / "ldconfig",
            "#!/bin/sh\nprintf '\\tlibz.so.1 (libc6,x86-64) => /lib/libz.so.1\\n'\nsleep 0.1\n"
            "i=0; while [ $i -lt 3000 ]; do i=$((i + 1)); "
            "printf '\\tlibfiller%d.so.1 (libc6) => /lib/libfiller.so\\n' $i || exit 141; done\n");
  chmod((tools / "ldconfig").c_str(), 0755);
  for (int k = 0; k < 3; ++k) {
    const Ending ending = Run("", "PATH=" + tools.string() + ":$PATH ");
    ASSERT_EQ(ending.exit_status, 0) << ending.text;
    EXPECT_THAT(ending.text, HasSubstr("carried because the machine has none: libcarried.so.2 \n"));
  }
}

TEST_F(GpuRoundTest, CachesOfShadersAreSharedByTheParts) {
  Program("drape_bench",
          "mkdir -p \"$__GL_SHADER_DISK_CACHE_PATH\" && echo x "
          ">>\"$__GL_SHADER_DISK_CACHE_PATH/used\"");
  ASSERT_EQ(Run().exit_status, 0);
  EXPECT_THAT(ReadText(pack_ / "cache" / "used"), HasSubstr("x\nx\nx\n"));
}

TEST_F(GpuRoundTest, SoftwareIsRefusedUnlessAllowed) {
  Program("drape_bench", "case \"$*\" in *--require-hardware*) exit 3 ;; esac");
  const Ending refused = Run();
  EXPECT_EQ(refused.exit_status, 3);
  EXPECT_THAT(refused.text, HasSubstr("no hardware OpenGL 4.5"));
  EXPECT_THAT(Summary(), HasSubstr("THE GL BACKEND WOULD RUN IN SOFTWARE"));
  EXPECT_EQ(Run("--allow-software").exit_status, 0);
}

TEST_F(GpuRoundTest, TooOldACLibraryIsToldBeforeAnythingRuns) {
  WriteFile(pack_ / "GLIBC", "99.1\n");
  const Ending ending = Run();
  EXPECT_EQ(ending.exit_status, 3);
  EXPECT_THAT(ending.text, HasSubstr("the programs need 99.1"));
}

TEST_F(GpuRoundTest, WrongArgumentsAreNamed) {
  const Ending ending = Run("--fast");
  EXPECT_EQ(ending.exit_status, 2);
  EXPECT_THAT(ending.text, HasSubstr("unknown argument '--fast'"));
  EXPECT_EQ(Run("--limit-s=soon").exit_status, 2);
  EXPECT_EQ(Run("--speed-s=0").exit_status, 2);
  fs::remove(pack_ / "COMMIT");
  EXPECT_THAT(Run().text, HasSubstr("was not made by 'gpu_round.sh pack'"));
}

class GpuRoundLong : public GpuRoundTest {};

TEST_F(GpuRoundLong, AHangEndsWithTheTimeLimitAndWhatWasMeasuredIsKept) {
  // Not in the smoke part.
  Program("parity_test",
          std::string(kPasses) + "; [ -z \"$GTEST_SHARD_INDEX\" ] || exec sleep 600");
  const Ending ending = Run("--limit-s=8");
  EXPECT_EQ(ending.exit_status, 1) << ending.text;
  EXPECT_THAT(Summary(), ContainsRegex("gl +passed"));
  EXPECT_THAT(Summary(), ContainsRegex("parity_2 +timed out +[0-9]+ s +1 ok, 0 failed"));
  EXPECT_THAT(Summary(), ContainsRegex("stability_0 +passed"));
  EXPECT_THAT(Packed(), HasSubstr("log/parity_2.log"));
}

// The lender may end it before its own limits do.
TEST_F(GpuRoundLong, ACutOffRoundKeepsWhatItHas) {
  Program("drape_bench", "[ \"$1\" = device ] || exec sleep 600");
  const Ending ending = Run("", "timeout 4 ");
  EXPECT_EQ(ending.exit_status, 124) << ending.text;
  EXPECT_THAT(Summary(), HasSubstr("cut off after"));
  EXPECT_THAT(Summary(), ContainsRegex("smoke_gl +passed"));
  EXPECT_THAT(Packed(), HasSubstr("log/smoke_parity.log"));
}

}  // namespace
}  // namespace drape::bench
