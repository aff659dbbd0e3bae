#include "server/api/token_file.h"

#include <gtest/gtest.h>

#include <string>

namespace drape::api {
namespace {

// printf %s secret | sha256sum
const std::string kHash = "2bb80d537b1da3e38bd30361aa855686bde0eacd7162fef6a25fe97bf527a25b";
// printf %s other | sha256sum
const std::string kOther = "d9298a10d1b0735837dc4bd85dac641b0f3cef27a47e5d53a54f2f3f5b2fcffa";

TEST(TokenFile, FindsTheTenantOfAToken) {
  const auto tokens = TokenFile::Parse(
      "# tenants\n\nlab-1 " + kHash + "  # since May\r\n  lab_2\t" + kOther + "\n", "file");
  ASSERT_TRUE(tokens.ok()) << tokens.status().message();
  EXPECT_EQ(tokens->TenantOf("secret"), "lab-1");
  EXPECT_EQ(tokens->TenantOf("other"), "lab_2");
  EXPECT_FALSE(tokens->TenantOf("").has_value());
  EXPECT_FALSE(tokens->TenantOf("secret ").has_value());
  EXPECT_FALSE(tokens->TenantOf(kHash).has_value()) << "the hash is no token";
}

TEST(TokenFile, ATenantMayHaveSeveralTokens) {
  const auto tokens = TokenFile::Parse("a " + kHash + "\na " + kOther + "\n", "file");
  ASSERT_TRUE(tokens.ok());
  EXPECT_EQ(tokens->TenantOf("secret"), tokens->TenantOf("other"));
}

TEST(TokenFile, AnOperatorIsNoTenant) {
  const auto tokens = TokenFile::Parse("@operator " + kHash + "\na " + kOther + "\n", "file");
  ASSERT_TRUE(tokens.ok()) << tokens.status().message();
  EXPECT_TRUE(tokens->IsOperator("secret"));
  EXPECT_FALSE(tokens->IsOperator("other"));
  EXPECT_FALSE(tokens->IsOperator(""));
  EXPECT_FALSE(tokens->TenantOf("secret").has_value());
  EXPECT_EQ(tokens->tenants(), std::set<std::string>{"a"});
}

TEST(TokenFile, ATenantMayHaveARateOfItsOwn) {
  const auto tokens = TokenFile::Parse(
      "a " + kHash + " particle_substeps_per_s=2.5e9 # fast\nb " + kOther + "\n", "file");
  ASSERT_TRUE(tokens.ok()) << tokens.status().message();
  EXPECT_EQ(tokens->rates(), (std::unordered_map<std::string, double>{{"a", 2.5e9}}));
  EXPECT_EQ(tokens->TenantOf("secret"), "a");
  EXPECT_TRUE(TokenFile::Parse("a " + kHash + " particle_substeps_per_s=0\na " + kOther +
                                   " particle_substeps_per_s=0\n",
                               "file")
                  .ok());
}

TEST(TokenFile, ATenantMayHaveAShareOfTheBuildersOfItsOwn) {
  const auto tokens = TokenFile::Parse(
      "a " + kHash + " builder_s_per_s=0.5 particle_substeps_per_s=7\nb " + kOther + "\n", "file");
  ASSERT_TRUE(tokens.ok()) << tokens.status().message();
  EXPECT_EQ(tokens->builder_rates(), (std::unordered_map<std::string, double>{{"a", 0.5}}));
  EXPECT_EQ(tokens->rates(), (std::unordered_map<std::string, double>{{"a", 7}}));
}

TEST(TokenFile, ATenantMayHaveAWeight) {
  const auto tokens = TokenFile::Parse(
      "a " + kHash + " weight=3 particle_substeps_per_s=10\nb " + kOther + "\n", "file");
  ASSERT_TRUE(tokens.ok()) << tokens.status().message();
  EXPECT_EQ(tokens->weights(), (std::unordered_map<std::string, uint32_t>{{"a", 3}}));
  EXPECT_EQ(tokens->rates(), (std::unordered_map<std::string, double>{{"a", 10}}));
}

TEST(TokenFile, WhatIsWrongIsNamedWithItsLine) {
  const auto why = [](const std::string& text) {
    const auto tokens = TokenFile::Parse(text, "file");
    EXPECT_EQ(tokens.status().reason(), "TOKEN_FILE_FAILED");
    return tokens.status().message();
  };
  EXPECT_EQ(why("# nothing\n"), "'file' has no token of a tenant");
  EXPECT_EQ(why("@operator " + kHash + "\n"), "'file' has no token of a tenant");
  EXPECT_NE(why("@operator " + kHash + " particle_substeps_per_s=1\n").find("line 1"),
            std::string::npos);
  EXPECT_NE(why("@admin " + kHash + "\n").find("line 1"), std::string::npos);
  EXPECT_NE(why("a " + kHash + "\n@operator " + kHash + "\n").find("line 2: this hash"),
            std::string::npos);
  EXPECT_NE(why("a " + kHash + "\nb secret\n").find("line 2: after the tenant"), std::string::npos);
  EXPECT_NE(why("a\n").find("line 1"), std::string::npos);
  EXPECT_NE(why("a " + kHash + " x\n").find("line 1"), std::string::npos);
  for (const char* rate :
       {"particle_substeps_per_s=", "particle_substeps_per_s=-1", "particle_substeps_per_s=nan",
        "particle_substeps_per_s=inf", "particle_substeps_per_s=1x", "particle_substeps_per_s=1 x",
        "builder_s_per_s=", "builder_s_per_s=-1", "builder_s_per_s=nan", "rate=1", "weight=0",
        "weight=101", "weight=1.5", "weight=-1", "weight="}) {
    EXPECT_NE(why("a " + kHash + " " + rate + "\n").find("line 1"), std::string::npos) << rate;
  }
  EXPECT_NE(
      why("a " + kHash + " particle_substeps_per_s=1\na " + kOther + " particle_substeps_per_s=2\n")
          .find("line 2: the tenant has another"),
      std::string::npos);
  EXPECT_NE(why("a " + kHash.substr(1) + "g\n").find("line 1"), std::string::npos);
  EXPECT_NE(why("a/b " + kHash + "\n").find("the tenant's name"), std::string::npos);
  EXPECT_NE(why("a " + kHash + "\nb " + kHash + "\n").find("line 2: this hash occurs twice"),
            std::string::npos);
  EXPECT_NE(TokenFile::Read("/nowhere").status().message().find("'/nowhere' cannot be read"),
            std::string::npos);
}

}  // namespace
}  // namespace drape::api
