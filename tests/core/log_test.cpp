#include "server/core/log.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace drape {
namespace {

using nlohmann::json;

const std::string kDigits = "0123456789abcdef0123456789abcdef";

// One case: the logger is set up once per process.
TEST(InitLog, RefusesUnknownLevelsAndWritesStructuredLines) {
  const Status status = InitLog("loud");
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.violations().front().field, "log-level");
  EXPECT_NE(status.message().find("'loud'"), std::string::npos);

  ::testing::internal::CaptureStderr();
  ASSERT_TRUE(InitLog("info").ok());
  spdlog::info("cloth_created id={} particles={}", 5, 1024);
  spdlog::debug("not_seen");
  EXPECT_EQ(SetLogLevel("loud").violations().front().field, "level");
  EXPECT_EQ(LogLevel(), "info");
  EXPECT_TRUE(SetLogLevel("debug").ok());
  EXPECT_EQ(LogLevel(), "debug");
  spdlog::debug("seen name=sessions/a-{} text={}", kDigits, LogText("two\nlines"));
  spdlog::default_logger_raw()->flush();
  const std::string lines = ::testing::internal::GetCapturedStderr();
  EXPECT_NE(lines.find("info cloth_created id=5 particles=1024\n"), std::string::npos) << lines;
  EXPECT_EQ(lines.find("not_seen"), std::string::npos);
  EXPECT_EQ(lines.find("20"), 0u) << "a line begins with the date: " << lines;
  EXPECT_NE(lines.find("debug seen name=sessions/a-0123... text=\"two\\x0alines\"\n"),
            std::string::npos)
      << lines;
}

json Parsed(const std::string& line) {
  const std::string text = "{" + LineAsJson(line) + "}";
  const json object = json::parse(text, nullptr, /*allow_exceptions=*/false);
  EXPECT_FALSE(object.is_discarded()) << text;
  return object;
}

TEST(LineAsJson, HasTheEventAndItsPairs) {
  EXPECT_EQ(Parsed("stopped"), (json{{"event", "stopped"}}));
  EXPECT_EQ(Parsed("session_created name=sessions/a-0123... ttl_s=300 half=0.5 exact=true"),
            (json{{"event", "session_created"},
                  {"name", "sessions/a-0123..."},
                  {"ttl_s", 300},
                  {"half", 0.5},
                  {"exact", true}}));
  EXPECT_EQ(Parsed("gl device=\"llvmpipe (LLVM 15.0)\" version=4.5.1 id=18446744073709551615"),
            (json{{"event", "gl"},
                  {"device", "llvmpipe (LLVM 15.0)"},
                  {"version", "4.5.1"},
                  {"id", UINT64_MAX}}));
}

TEST(LineAsJson, NoPairTakesTheNameOfAMemberOfEveryLine) {
  EXPECT_EQ(LineAsJson("changed level=debug time=3 event=more"),
            R"("event":"changed","event_level":"debug","event_time":3,"event_event":"more")");
}

TEST(LineAsJson, TakesTextsOfStrangersAsTheyAre) {
  for (const std::string& text :
       {std::string("plain"), std::string("a \"quoted\" word"), std::string("\" b=c"),
        std::string("back\\slash\\"), std::string("ends in \\\""), std::string(""),
        std::string("\xc3\xa4 \xe2\x82\xac")}) {
    const json object = Parsed("request text=" + LogText(text) + " last=1");
    EXPECT_EQ(object["text"], text);
    EXPECT_EQ(object["last"], 1) << text;
    EXPECT_EQ(object.size(), 3u) << text;
  }
  // Not UTF-8, and not of our form: still an object.
  Parsed("request text=\"\xff\xfe\" last=1");
  EXPECT_EQ(Parsed("protobuf Some words of a library, x = y")["text"],
            "Some words of a library, x = y");
  Parsed("");
  Parsed(" =");
  Parsed("a b=\"never ended");
}

TEST(WithoutSessionNames, ShowsFourDigits) {
  EXPECT_EQ(WithoutSessionNames("name=sessions/test-" + kDigits + " b"),
            "name=sessions/test-0123... b");
  EXPECT_EQ(WithoutSessionNames("test-" + kDigits), "test-0123...");
  EXPECT_EQ(WithoutSessionNames("a7-" + kDigits + "-b8-" + kDigits), "a7-0123...-b8-0123...");
  EXPECT_EQ(WithoutSessionNames("test-" + kDigits + kDigits), "test-0123...");
  EXPECT_EQ(WithoutSessionNames("request_id=\"" + kDigits + "\""), "request_id=\"0123...\"");
  EXPECT_EQ(WithoutSessionNames("x" + kDigits), "x0123...");
  for (const std::string& kept :
       {std::string("sessions/test-0123..."), std::string("a-b-c"), kDigits.substr(1),
        std::string("2f1c8a52-9f2b-4c3d-8e1f-0123456789ab"), std::string("-"), std::string("a-")}) {
    EXPECT_EQ(WithoutSessionNames(kept), kept);
  }
}

}  // namespace
}  // namespace drape
