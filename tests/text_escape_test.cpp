// Texts from outside, as terminals, shells and files are to read them.
#include "base/text_escape.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "error.hpp"
#include "run_program.hpp"

namespace clerestory::test {
namespace {

using testing::HasSubstr;

TEST(TextEscape, Base64IsThatOfTheRfc) {
    EXPECT_EQ(base64(""), "");
    EXPECT_EQ(base64("f"), "Zg==");  // RFC 4648's own examples
    EXPECT_EQ(base64("fo"), "Zm8=");
    EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
    EXPECT_EQ(base64(std::string("\xff\x00\xfe", 3)), "/wD+");
}

TEST(TextEscape, WordsStandAsTheyAreWhereAShellTakesThemSo) {
    EXPECT_EQ(shell_word("maps/a-1.exr"), "maps/a-1.exr");
    EXPECT_EQ(shell_word("it's here"), "'it'\\''s here'");
    EXPECT_EQ(shell_word(""), "''");
    EXPECT_EQ(shell_path("-o.exr"), "./-o.exr");
    EXPECT_EQ(shell_path("a/-o.exr"), "a/-o.exr");
}

/// Every byte that a file's name can have, alone and between digits, is what bash reads, in one line.
TEST(TextEscape, AShellReadsEveryNameBack) {
    std::vector<std::string> words = {"$(touch x)", "`x`",      "a\nb",  "'",  "\\'", "*",
                                      "~",          "\xc3\xa4", "a\x9b", "!!", "#",   "--"};
    for (int byte = 1; byte < 256; ++byte) {
        words.emplace_back(1, static_cast<char>(byte));
        words.push_back("7" + words.back() + "7");
    }
    std::string script = "printf '%s\\0'";
    std::string expected;
    for (const std::string& word : words) {
        const std::string quoted = shell_word(word);
        EXPECT_EQ(quoted.find('\n'), std::string::npos);
        script += " " + quoted;
        expected += word + '\0';
    }
    EXPECT_EQ(run_command({"bash", "-c", script}).out, expected);
}

TEST(TextEscape, ATerminalObeysNothing) {
    EXPECT_EQ(one_line("a\n\tb\r\x1b[2J\x7f"), "a\\n\\tb\\x0d\\x1b[2J\\x7f");
    EXPECT_EQ(one_line("caf\xc3\xa9 \xe2\x82\xac \xf0\x9f\x98\x80"), "caf\xc3\xa9 \xe2\x82\xac \xf0\x9f\x98\x80");
    EXPECT_EQ(one_line("\xc2\x9b"
                       "31m"),
              "\\u009b31m")
        << "the second set of controls";
    EXPECT_EQ(one_line("\xe2\x80\xae"
                       "txt.exe"),
              "\\u202etxt.exe")
        << "right to left";
    EXPECT_EQ(one_line("\xe2\x81\xa6"), "\\u2066");
}

TEST(TextEscape, BytesThatAreNoUtf8AreNumbers) {
    // Alone, cut short, longer than need be, a surrogate, beyond the last character.
    EXPECT_EQ(one_line("\x9b \xff"), "\\x9b \\xff");
    EXPECT_EQ(one_line("\xe2\x82"), "\\xe2\\x82");
    EXPECT_EQ(one_line("\xc0\x8a"), "\\xc0\\x8a");
    EXPECT_EQ(one_line("\xe0\x80\x8a"), "\\xe0\\x80\\x8a");
    EXPECT_EQ(one_line("\xed\xa0\x80"), "\\xed\\xa0\\x80");
    EXPECT_EQ(one_line("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80");
    EXPECT_EQ(one_line("\xe2(\xa1"), "\\xe2(\\xa1");
}

TEST(TextEscape, ErrorsAreAsManyLinesAsWereMeant) {
    EXPECT_STREQ(InputError("a\nb\x1b").what(), "a\\nb\\x1b");
    EXPECT_STREQ(InputError(std::vector<std::string>{"a\nb", "c"}).what(), "a\\nb\nc");
}

TEST(TextEscape, NoCommandSaysANameRaw) {
    const TempFolder folder;
    const std::string name = folder.file("a\x1b[2J\nclerestory: all is well\x9b.exr");
    for (const std::vector<std::string>& arguments : {std::vector<std::string>{"info", name},
                                                      {"render", name, "-o", "x.exr"},
                                                      {"batch", name},
                                                      {"merge", name},
                                                      {"compare", name, name},
                                                      {"render", "-o", name + "/x.exr", "-n", name},
                                                      {name},
                                                      {"--" + name},
                                                      {"info", "--" + name}}) {
        const ProgramResult result = run_program(arguments, {.environment = {}, .folder = folder.path()});
        EXPECT_NE(result.exit_code, 0);
        EXPECT_EQ(result.err.find_first_of("\x1b\x9b"), std::string::npos) << result.err;
        EXPECT_EQ(result.err.find("\nclerestory: all is well"), std::string::npos) << result.err;
        EXPECT_THAT(result.err, HasSubstr("\\x1b[2J"));
    }
}

}  // namespace
}  // namespace clerestory::test
