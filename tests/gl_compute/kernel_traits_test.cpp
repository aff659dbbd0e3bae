#include "server/solver/gl_compute/kernel_traits.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>
#include <set>
#include <string>

#include "server/gl/shader_source.h"
#include "server/solver/gl_compute/kernels.h"
#include "shaders/embedded_shaders.h"

namespace drape {
namespace {

std::set<std::string> WordsOf(std::string_view text) {
  static const std::regex kWord("\\bHAS_[A-Z_]+\\b");
  const std::string source(text);
  std::set<std::string> words;
  for (std::sregex_iterator it(source.begin(), source.end(), kWord), end; it != end; ++it) {
    words.insert(it->str());
  }
  return words;
}

TEST(KernelTraitsTest, StagesAndFeaturesAreNamedAlike) {
  TraitSet traits = {StepStage::kSolveStrips, Feature::kRegularStrips};
  EXPECT_EQ(traits.Defines(), "#define HAS_SOLVE_STRIPS\n#define HAS_REGULAR_STRIPS\n");
  traits.Add(StageSet{StepStage::kApplyWind});
  EXPECT_TRUE(traits.Has(StepStage::kApplyWind));
  EXPECT_FALSE(traits.Has(StepStage::kApplySprings));
  EXPECT_EQ(traits & TraitSet({StepStage::kApplyWind, Feature::kPins}),
            TraitSet{StepStage::kApplyWind});
}

// A misspelt condition would always be false.
TEST(KernelTraitsTest, ShadersAskForTraitsThatExist) {
  std::set<std::string> known = {"HAS_STRIP_HALVES", "HAS_STRIP_REDUCTION", "HAS_SUBGROUPS"};
  known.insert(TraitDefines().begin(), TraitDefines().end());
  for (const EmbeddedShader& shader : EmbeddedShaders()) {
    for (const std::string& word : WordsOf(shader.text)) {
      EXPECT_TRUE(known.contains(word)) << word << " in " << shader.path;
    }
  }
}

// A trait that a kernel does not ask for would only compile it twice.
TEST(KernelTraitsTest, TiledKernelsReadTheTraitsOfTheirRows) {
  gl::ShaderLibrary library;
  for (const EmbeddedShader& shader : EmbeddedShaders()) {
    library.Add(std::string(shader.path), std::string(shader.text));
  }
  for (const TiledKernel& kernel : TiledKernels()) {
    const Result<gl::ShaderSource> source =
        library.Assemble("kernels/" + std::string(kernel.file) + ".comp", "");
    ASSERT_TRUE(source.ok()) << source.status().ToString();
    const std::set<std::string> asked = WordsOf(source->text);
    for (const std::string& word : WordsOf(kernel.reads.Defines())) {
      EXPECT_TRUE(asked.contains(word)) << kernel.file << " does not ask for " << word;
    }
  }
}

}  // namespace
}  // namespace drape
