"""Turns of phrase that no reader takes word by word, put in words that mean the same: "down the middle"."""

from __future__ import annotations

import re
from collections.abc import Callable, Container
from functools import cache

from ovita.instruct.objects import head_of
from ovita.paths.scene import Scene

_ENDS = r"(?:start|begin)(?:ing)? and (?:stop|end|finish)(?:ing)?"
_ON = r"(?:through|on|past|by|going|moving|driving|flying|rolling)"
_GO = r"(?:go|drive|fly|walk|run|ride|move|roll|sail|travel|head|come)"
_GOES = rf"(?:{_GO}|(?:go|fly|walk|run|rid|mov|roll|sail|travell?|head|com|driv)ing)"
_N = r"\d+(?:\.\d+)?"
_WORD = (
    r"(?:(?:one|two|three|four|five|six|seven|eight|nine|ten|twelve|fifteen|twenty|thirty|forty|fifty|sixty)"
    r"(?: (?:hundred|thousand))?)"
)
_SOME = rf"(?:{_N}|{_WORD}|a few|few|many|some|no|lots of|plenty of)"
_MUCH = r"(?:(?:a (?:bit|little)|much|even) )?"
_NOW = r"(?:it is |it's )?(?:now|before|currently|at the moment|at present)"
_TIME = r"(?:s|secs?|seconds?|min|minutes?)"
_FARTHER = r"(?:higher|lower|further|farther|closer|nearer)"
_UNIT = rf"(?:{_TIME}|mm|cm|m|centimet(?:re|er)s?|met(?:re|er)s?|m/s|times|percent|%)"
_TO = r"(?:(?:down|up|over|back|out|along|in|on) )?(?:to|towards?) "
_PART = r"(?:bit|part|stretch|piece|section|leg)"
_AT = r"(?:in|at|on|over|by|with|near|above)"
_BY = r"(?:over|above|around)"
_STAND = r"(?:wait|waiting|hover|hovering|stop|pause|hold|dwell|stay|standing)"
_SIDE = r"(?:the )?(?:left|right|front|back|side|start|goal)\b"
_SOFTLY = r"(?:more |very |nice and )?(?:gently|softly|slowly|slower|gentler|softer|carefully)\b"

_BUMP = r"(?:touch|hit|bump|crash|knock|brush|scratch|graze|ram)"
_COMES_NEAR = (
    r"\b(?:whenever|when|if|where|wherever|while) (?:something|anything|(?:an?|any) (?:object|obstacle|thing)) "
    r"(?:is|are|comes?|gets?)(?: less than| closer than| nearer than| within)? "
    rf"(?P<q>{_N} ?{_UNIT})(?: away)?\b"
)

_BIT = (
    r"(?:the|its) (?P<part>last (?:stretch|bit|part|section|leg|piece)|final (?:stretch|bit|part|section|leg)|tail end"
    r"|(?:climbing|rising|descending|falling) (?:bit|part|section|stretch)|climb|ascent|descent"
    r"|(?:first|second|last) half|(?:first|middle|last) (?:third|quarter))(?: of (?:the|its) \w+)?"
)
_HELIX = r"an? (?:corkscrew|spiral|helix)\b"


def _wound(found: re.Match[str]) -> str:
    """A part of the path that is to wind, in words for that part: "turn the last stretch into a corkscrew"."""
    part = found["part"].lower()
    if part in ("down", "up") or part.startswith(("climb", "ris", "ascent", "desc", "fall")):
        return f"a spiral in the {'descent' if part.startswith(('down', 'desc', 'fall')) else 'climb'}"
    return f"a spiral in the {part if part.endswith(('half', 'third', 'quarter')) else 'last quarter'}"


def _pace_for(percent: float, more: str) -> float:
    """How many times as fast something is that takes so many per cent longer, or less time."""
    return 1.0 / max(1.0 + (1 if more in ("longer", "more time") else -1) * percent / 100.0, 0.01)


_SAID: tuple[tuple[re.Pattern[str], str | Callable[[re.Match[str]], str]], ...] = tuple(
    (re.compile(said, re.IGNORECASE), meant)
    for said, meant in (
        (
            r"\b(?:come down|land|touch down|finish|end|arrive|end up) (?:again )?(?:at|in|on) (?:exactly )?the same "
            r"(?:place|spot|point|position)\b",
            "keep the end",
        ),
        (rf"\b{_ENDS} (?:at|in|on) the same (?:place|spot|point|position)s?\b", "keep the start and the end"),
        (r"\b(?:normal|usual|regular) speed (?=till|until|up to)", "keep the speed "),
        (r"\bdown the middle\b", "through the middle"),
        (
            rf"\b(?:stop|halt|come to rest) (?={_N} ?{_UNIT} (?:above|over|below|under)\b)"
            r"(?!.*\b(?:for|then|continue|carry on|go on)\b)",
            "end ",
        ),
        (rf"\b(?:stop|halt) (?={_N} ?{_UNIT} (?:above|over) (?:the )?[\w' -]+ for\b)", "hover "),
        (r"\b(?:the|its|these|those) two ends\b", "both ends"),
        (rf"\b(?:turn|make|bend|change) {_BIT} (?:(?:in)?to )?{_HELIX}", _wound),
        (rf"\b(?:come|comes|go|goes|fly|flies) (?P<part>down|up) in {_HELIX}", _wound),
        (r"\bstart(?P<s>s|ing)? off (?=slow|fast|quick|gentl|soft)", r"start\g<s> "),
        (r",? (?:instead of|rather than|and not|not) the other way (?:a?round|about)\b", ""),
        (  # not "turn right into the aisle"
            r"(?<!turn )(?<!turns )(?<!go )(?<!move )(?<!shift )(?<!veer )(?<!steer )(?<!to the )"
            r"(?<!more )(?<!further )\bright (?=(?:into|onto|through|on top of|next to|beside|behind|over|above)\b)",
            "",
        ),
        (r"\b(?P<go>fly|flies|flying|run|runs|driv(?:e|es|ing)) right (?=over\b)", r"\g<go> "),
        (r"\barch(?:es|ing)? (?=up|over|to the)", "go "),
        (r"\bfrom side to side\b", "side to side"),
        (
            r"\b(?:stop|halt|come to (?:rest|a stop|a halt))"
            r" (?:briefly|shortly|momentarily|for a (?:moment|bit|while))\b"
            r"|\b(?:briefly|shortly) (?:stop|halt|come to rest)\b",
            "wait",
        ),
        (
            # "increase the hover time at pier 2 to five seconds"
            r"\b(?:increase|extend|prolong|lengthen|shorten|reduce|cut|decrease|set|change|raise|make)"
            rf" the {_STAND}(?: time)?(?P<at> {_AT} (?:(?!\b(?:and|to|by)\b)[^.,;!?])+?)?"
            rf" (?:to(?: be)?|last|be) (?P<q>(?:{_N}|{_WORD}) ?{_TIME})\b",
            lambda it: f"wait {it['q']}{it['at'] or ''}",
        ),
        (
            # what it does after a wait says when
            r"(?P<wait>\b(?:wait|pause|hold|stay|rest)\b[^.;!?]*?),?"
            r" before (?:it|he|she|you|they|the (?:robot|arm|drone))"
            r" (?:lifts?|rises?|goes|go|moves?|leaves?|starts?|continues?|drives?|flies|fly|carries|carry)"
            r"(?: up| on| off| away| it| again)?(?=\s*(?:$|[.,;!?]))",
            r"\g<wait>",
        ),
        (
            r"\bfrom the (?:middle|midpoint|half ?way point)"
            r"(?: of (?:the|its) (?:path|route|way|run|flight|trajectory))?"
            r" (?:on(?:wards?)?|(?:on )?to(?:wards)? the end)\b",
            "in the last half",
        ),
        (r"\bfrom the (?:start|beginning) to the (?:middle|midpoint|half ?way point)\b", "in the first half"),
        (rf"(?P<q>\b(?:{_N}|{_WORD}) ?{_UNIT} )(?:further|farther) out\b", r"\g<q>farther"),
        (r"\b(?:go|run) through it (?=at (?:an? )?(?:constant|steady|even|uniform|speed|pace|\d))", "go "),
        (
            r",? (?:until|till) (?:it|you|he|she) (?:stops|stop|halts|halt|arrives|arrive|ends|end|gets|get|is|are) "
            r"(?:at|on|by|to) (?:the )?(?:goal|end|destination|finish)(?=\s*(?:$|[.,;!?]))",
            "",
        ),
        (  # said to the person, not to the robot
            rf"^(?P<lead>\W*)quick[,!] "
            rf"(?=(?:{_GO}|stay|keep|pass|shift|stop|wait|slow|lift|raise|lower|turn|end|swing)\b)",
            r"\g<lead>",
        ),
        (rf"^(?P<when>{_COMES_NEAR}),? (?P<rest>[^.;]+)$", r"\g<rest> \g<when>"),
        (_COMES_NEAR, r"within \g<q> of any object"),
        (
            r"\bstop (?=(?:next to|at|by|near|beside|in front of|over|above) (?:(?!\band\b)[^.,;!?])+? "
            r"(?:so(?: that)? \w+(?: \w+)? (?:can|may|could)|to let)\b)",
            "wait ",
        ),
        (  # what people do meanwhile
            r",? \bso(?: that)? (?:I|we|he|she|they|people|everyone) (?:can|could|may|might)\b[^.;!?,]*?"
            r"(?=\s*(?:$|[.;!?,]|\b(?:and )?then\b))",
            "",
        ),
        (
            r"\b(?:start|begin|set off|take off)(?: off| out)? (?:gently|slowly|softly|slow|easy)\b,?(?: and| but)?"
            r"(?: then| after that)?(?: (?:go|continue|carry|proceed|drive|fly|run|move))?(?: on)?(?: at| with| to)?"
            r"(?: the| its| your)? (?:normal|usual|regular|same|old) (?:pace|speed)\b(?: as (?:before|now))?",
            "slower at the start",
        ),
        (
            r"\b(?:start|begin)(?: off| out)? (?:gently|slowly|softly|slow)(?:,| and) (?:then )?"
            r"(?:pick up (?:speed|pace)|get faster|speed up|accelerate)\b",
            "speed up gradually",
        ),
        (
            r"\b(?:set|put|lay|plac)(?:e|ing|ting)? (?:it|them|that|the \w+) down (?P<by>\S+ ?(?:mm|cm|m)\b) "
            r"(?:further |more )?(?P<way>lower|higher|further down|further up)\b",
            r"end \g<by> \g<way>",
        ),
        (
            rf"\b(?:take|takes|taking|last|lasts|be|run) (?:(?:about|some|roughly) )?(?P<q>{_N}) ?(?:%|per ?cent) "
            r"(?P<more>longer|more time|less time|less long|shorter)\b",
            lambda it: f"go at {_pace_for(float(it['q']), it['more'].lower()):.4g} times the speed",
        ),
        (
            rf"\b(?P<do>{_STAND})(?: it)? (?:for )?(?:a|one) (?P<unit>second|sec|minute)\b"
            r"(?=\s*(?:$|[.,;!?]|(?:over|above|at|near|by|in|on|before|and|then|there)\b))",
            r"\g<do> 1 \g<unit>",
        ),
        (  # "stop a bit short of the end, say half a metre"
            r"\b(?:a (?:bit|little|touch|tad)|slightly|somewhat) (?P<how>[^.,;!?]+), (?:say|like|maybe|about|perhaps) "
            rf"(?P<q>(?:half an? |an? )?(?:{_N} ?)?{_UNIT})\b",
            r"\g<q> \g<how>",
        ),
        (r"\b(?P<pace>slower|faster)[.,;:] ?(?P<by>half|twice)\b", r"\g<pace> by \g<by>"),
        (
            rf"\bstop (?=(?:{_MUCH}|slightly |a (?:touch|tad) |{_N} ?{_UNIT} )(?:higher|lower)\b)",
            "end ",
        ),
        (r"\bat (?:the )?begin\b", "at the beginning"),
        (
            rf"(?P<wait>\b(?:{_STAND}|hang|linger)\b[^.;!?]*?) (?:right |just |directly )?after (?:you|it|he|she)"
            r"(?:'ve|'s| have| has)? (?:picked|grabbed|gripped|taken|got) (?:it|them|the \w+)(?: up)?\b"
            r"(?: before moving on)?",
            r"\g<wait> at the pick-up",
        ),
        (  # what the limits see to anyway where a thing is passed; who goes to it and is not to touch it says more
            rf"(?P<pass>\b(?:{_BY}|over|around|round|past|under|below|closer|nearer|higher|lower)\b[^.;!?]*?)"
            r",? ?\b(?:but|and|so(?: that)?)(?: (?:it|you|we|he|she|they))? "
            rf"(?:don'?t|do not|does not|doesn'?t|not|won'?t|without) {_BUMP}(?:ing)?(?: into| over| against)? "
            r"(?:it|them|him|her|anything|anyone)\b(?:,? (?:ok|okay)\b)?",
            r"\g<pass>",
        ),
        (r"\bhover there\b", "wait there"),
        (r"^\W*on second thoughts?,? ", ""),
        (r"^.*\bthe first (?:amount|one|distance|version|value|try) was (?:better|fine|good|ok|okay)\W*$", "undo that"),
        (r"\bgo (?:further|farther) (?=(?:to the )?(?:left|right)\b)", "move further "),
        (r"\bclimb (?=no |not |above\b|below\b|over \d|higher than\b)", "go "),
        (r"\b(?:up|over|out) there\b", "there"),
        (r"\b(?:and )?count to (?P<n>\w+)\b", r"for \g<n> seconds"),
        (
            rf"\b(?:scale|multiply) (?:the |its )?speeds? by (?P<n>{_N})(?! ?(?:%|m/s|per))",
            r"go at \g<n> times the speed",
        ),
        (r"\btouch down (?=(?:beside|next to|near|by|behind|left of|right of|in front of)\b)", "land "),
        (r"\b(?:done|there|back|finished|through) in half (?:the|its|that) time\b", "twice as fast"),
        (r"\bcome back (?:down|up) to the (?:original|same|old|previous|normal) (?:altitude|height|level)\b", ""),
        (
            r"\b(?P<pace>(?:too|so|quick|fast|slow|gent|careful)\w*\b.*[.!,]) *"
            r"(?:easy|careful|gently|slowly|steady)\W*$",
            r"\g<pace>",
        ),
        (
            r"\b(?P<wait>(?:wait|pause|hold|stay|hover)\b[^.;!?]*?),? before (?:you|it|he|she) "
            r"(?:lowers?|sets?|puts?|plac(?:es?)|goes? down|comes? down|descends?)(?: (?:it|them|the \w+))?(?: down)?"
            r"(?=\s*(?:$|[.,;!?]))",
            r"\g<wait> before the put-down",
        ),
        (
            rf"\b(?:put|set|lay|place) (?:it|him|her|them|that|this|the \w+) down (?P<by>{_N} ?(?:%|per ?cent) "
            r"(?:slower|faster))",
            r"\g<by> at the put-down",
        ),
        (r"\b(?:could|can|would) you (?:please )?not (?=\w)", "don't "),
        # how it is now says nothing of how it is to be
        (rf"(?P<n>\b{_N} ?{_UNIT} \w+) than {_NOW}\b", r"\g<n>"),
        (
            rf"\b(?:stay|keep|remain|hold|carry)(?: it)? (?={_N} ?{_UNIT} {_FARTHER}\b)",
            "go ",
        ),
        (rf"\b{_GO} on (?=(?:the|its|his|her|their|my|your) (?:\w+ )?side\b)", "pass on "),
        (rf"\b(?:when|while|as|whenever) (?:you|it|he|she|the \w+) {_GO}s? {_TO}(?!{_SIDE})", "on the way to "),
        (rf"\b(?:when|while) {_GOES} {_TO}(?!{_SIDE})", "on the way to "),
        (
            r"\b(?:(?:right |just |shortly )?before|when|while|as) (?:you |it |he |she )?"
            r"(?:sett?(?:s|ing)?|put(?:s|ting)?|plac(?:es?|ing)|lays?|laying|lower(?:s|ing)?) "
            r"(?:it|them|him|her|that|the (?!speed|height|pace|path|start|goal|end)\w+)(?: down)?"
            r"(?=\s*(?:$|[.,;!?]|and\b))",
            "at the put-down",
        ),
        (
            rf",? ?\b(?:we|i|they)(?: have|'ve got|'ve| have got| got)(?: only| just| about)? {_SOME}(?: (?:of )?\w+)? "
            r"(?:left|to (?:do|go|make|bring))\b",
            "",
        ),
        (
            r"(?:^|, ?| )\b(?:as |because |since )?(?:we|i|they)(?: are|'re| am|'m|re)"
            r"(?: running| already| a bit| very| so)* (?:late|behind schedule|in a hurry)\b",
            "",
        ),
        (rf"\b{_GO} the {_PART} (?=between\b)", ""),
        (
            r"\b(?:skip|drop|leave out|cut|lose|no need for) the (?:hold|pause|wait|stop|halt)\b(?!s)"
            r"(?! (?:at|by|near|in|on|over|before|behind|above))",
            "make no stop",
        ),
        (r"\bon the straight (?:runs?|bits?|parts?|stretches|sections?|lines?|legs?)\b", "on the straights"),
        (
            r"\bstill (?:end|ends|finish|stop|stops|arrive|land) (?:at|on|in|by) the \w+(?: \w+)?(?=\s*(?:$|[.,;!?]))",
            "keep the end",
        ),
        (
            r"\b(?P<wait>wait|hold|pause|stay)(?: it)?(?: (?:a )?(?:little|bit)(?: bit)?)?"
            r" (?:more(?: time)?|longer)\b(?! than)",
            r"\g<wait> longer",
        ),
        (
            r"\b(?:set|put|plac|lay)(?:t?ing|e|ing)? (?:it|the \w+) down "
            r"(?P<by>(?:about |some |roughly |around )?\S+ \w+) "
            r"(?:further |farther |more )?(?:to the )?(?P<way>left|right)\b(?: (?:in|on|of|at) the \w+)?",
            r"put-down \g<by> further \g<way>",
        ),
        (r"\b(?:a|one) (?=(?:second|sec|minute) (?:longer|more|earlier|later|sooner)\b)", "1 "),
        (rf"\b(?P<wait>(?:wait|hold|pause|stay)(?: for)? {_N} ?{_TIME}) more\b(?! than)", r"\g<wait> longer"),
        (
            r"\b(?:arrive|get there|get here|be there|be back|be home) (?P<much>(?:a (?:little|bit)|slightly|much) )?"
            r"(?:(?P<soon>earlier|sooner)|later)\b(?! than)",
            lambda it: f"go {it['much'] or ''}{'faster' if it['soon'] else 'slower'}",
        ),
        (
            rf"\b(?:start|leave|set off|depart) (?P<by>\S+ ?{_TIME}) later\b",
            r"wait \g<by> at the start",
        ),
        (r"\b(?:there is |there's )?no need (?:to |for )(?:hurry|rush|race|speed)\b", "don't rush"),
        (
            r"\b(?:(?:get|have) (?:it|this|the whole thing|everything) done"
            r"|(?:do|run|finish) (?:it|this|the whole thing|everything)|be done|be there|get there)"
            r" in half (?:the|its) time\b",
            "go twice as fast",
        ),
        (
            rf"\b(?:touch down|settle|come to rest|set down) (?={_MUCH}{_SOFTLY})",
            "at the end slow down ",
        ),
        (
            r"\b(?:no|less) (?:jerk(?:y|ing|s)?|shak(?:y|ing)|abrupt|wobbl(?:y|ing|e)|jitter)"
            r"(?: moves?| movements?| motions?)?\b",
            "smoother",
        ),
        (r",? just not (?:over|near|at|by|around|past) ", " except near "),
        (r"\bhand (?:it|them|the \w+) over\b", "at the end"),
        (r"\btoo much (?=(?:fast|slow|high|low|close|near|far|quick)\b)", "too "),
        (
            rf"\b(?P<stop>stop|end|finish|halt|park) (?P<q>\S+ {_UNIT}) (?:further|farther) back\b",
            r"\g<stop> \g<q> earlier",
        ),
        (rf"\b(?:the )?(?:last|final) {_PART} (?={_BY} )", ""),  # what is beside a thing is told by that alone
        (
            r"\bcome in (?:(?:a (?:bit|little)|more|nice and|very) )?(?:gently|softly|slowly|slower|gentler|easy)"
            r"(?=\s*(?:$|[.,;!?]|and\b))",
            "slow down at the end",
        ),
        (
            r"\b(?:put|set|lay|place) (?:it|him|her|them|that|this|the \w+) down (?:(?:on|onto|in|into|at) the \w+ )?"
            rf"(?={_MUCH}{_SOFTLY})",
            "at the put-down slow down ",
        ),
        (
            # what follows a stop that is denied says no more than that
            r"(?P<no>\b(?:no|not|don'?t|doesn'?t|never|without|skip)\b(?:(?!\b(?:and|but)\b)[^.;!?,]){0,25}"
            r"\b(?:stop|wait|paus|halt)[^.;!?,]*),?"
            rf"\s+(?:and\s+)?(?:just\s+|simply\s+)?(?:drive|go|fly|carry|keep|pass|roll|move|run)\s+(?:straight\s+|right\s+)?{_ON}"
            r"(?:\s+it|\s+to\s+(?:the\s+)?[\w ]{1,30})?(?=\s*(?:$|[.!,;]))",
            r"\g<no>",
        ),
    )
)


_PACE = rf"{_MUCH}(?:faster|quicker|slower|(?:more )?(?:slowly|quickly))"

_NAMED: tuple[tuple[str, str], ...] = (
    (rf"\b(?P<pace>{_PACE}) (?:to|towards?) (?=%s)", r"\g<pace> on the way to "),
    (
        rf"\b{_GO} {_TO}(?P<to>%s) (?P<pace>{_PACE})\b",
        r"\g<pace> on the way to \g<to>",
    ),
    (
        rf"\b(?P<but>and|but) (?:(?:{_GO}|bring|carry|take|put)(?: it| them| the \w+)? )?{_TO}(?P<to>%s)"
        rf" (?:just |exactly )?as (?:fast|slow|slowly|quick|quickly) as {_NOW}",
        r"\g<but> on the way to \g<to> keep the speed",
    ),
    (rf"(?P<earlier>\b\S+ {_UNIT} (?:earlier|sooner)) (?:from|of|before) %s", r"\g<earlier>"),
    (
        rf"\bstay (?:{_AT} )?(?P<at>%s)(?: a (?:bit|little|moment))? longer\b",
        r"wait longer at \g<at>",
    ),
    (rf"\bstay (?:a (?:bit|little|moment) )?longer {_AT} (?=%s)", "wait longer at "),
    (r"\b(?:don'?t|do not|never) (?:go|drive|fly|pass|walk|move|run) behind (?=%s)", "pass in front of "),
    (r"\b(?:don'?t|do not|never) (?:go|drive|fly|pass|walk|move|run) in front of (?=%s)", "pass behind "),
    (rf"\b{_GO} past (?P<at>%s),? (?:and )?(?:then|after that) ", r"after \g<at> "),
    (
        r"\b(?P<do>shift|move|offset|raise|lower|lift) (?:the )?(?P<at>%s)(?:'s|s') (?:pass|line|run|swath|leg)\b",
        r"near \g<at> \g<do> the path",
    ),
    (
        r"\b(?P<do>shift|move|offset|raise|lower|lift) the (?:pass|line|run|swath|leg)"
        r" (?:over|along|at|near|by|past) (?P<at>%s)",
        r"near \g<at> \g<do> the path",
    ),
    (
        r"(?P<one>%s) (?:must(?:n'?t| not)|should(?:n'?t| not)|can(?:'?t|not| not)|may not) (?:be|get) "
        r"(?:bumped|knocked|hit|touched|brushed|scratched|grazed|disturbed)(?: into| over| against)?\b",
        r"do not touch \g<one>",
    ),
    (r"\btake (?P<one>%s) on (?:its|his|her|the|your) (?P<side>left|right)(?: side)?\b", r"pass \g<side> of \g<one>"),
    (r"\bdip (?:down )?(?:in)?to (?P<one>%s) for\b", r"go down to \g<one> and wait at \g<one> for"),
    (
        r"\bas soon as (?:you|it|he|she|we) (?:get|gets|come|comes|are|is) (?:near|close to|within reach of) (?=%s)",
        "near ",
    ),
    (
        r"\b(?:(?:pass|go|drive|fly|run|mov)(?:e|es|ing)? )?(?:more|further|farther) (?:over )?to the "
        r"(?P<way>left|right) of (?P<one>%s)",
        r"move further \g<way> near \g<one>",
    ),
    (
        r"\b(?:don'?t|do not|never) (?:zip|rush|race|dash|zoom|shoot|whizz|tear|hurtle|speed)"
        r"(?: (?:across|past|by|over|along|through|around))? (?P<one>%s)(?: (?:like that|so (?:much|fast)))?",
        r"go slower near \g<one>",
    ),
    (
        rf"\b(?P<go>{_GO} (?:{_MUCH}|slightly )(?:higher|lower|slower|faster|quicker|wider|slowly|quickly)) past "
        r"(?=%s)",
        r"\g<go> near ",
    ),
    (r"\b(?P<above>above|over) the (?:rim|top|lid|lip|brim|roof) of (?=%s)", r"\g<above> "),
    (
        rf"\b(?:come|go|fly|get|dip|drop|sink|move)(?: down| up)? to (?P<q>\S+ ?{_UNIT}) (?:above|over) (?P<one>%s)",
        r"pass \g<q> over \g<one>",
    ),
    (r"\bto the (?P<one>%s) side\b", r"toward \g<one>"),
    (r"\bboth (?P<one>%s) and (?=%s)", r"\g<one> and "),
    (r"(?P<one>%s) or (?=%s\s*(?:$|[.,;!?]|and\b))", r"\g<one> and "),
)
"""Turns of phrase about objects, whose names stand for each %s."""


_COMPLAINT = re.compile(
    r"^(?P<lead>\W*)(?P<who>it|this|that|he|she|you|the (?:robot|arm|drone|rover|thing|machine))"
    r"(?: (?:always|really|just|practically|sort of|kind of|still))? "
    r"(?:(?P<fast>rush|dash|rac|bolt|shoot|tear|hurtl|whizz|zoom|speed)|(?P<slow>crawl|creep|dawdl|plod|drag)"
    r"|(?P<how>jerk|jolt|shak|wobbl|rattl|judder|stutter|sway))(?P<form>e?s|e|ing)?"
    r"(?: (?:off|away|along|through))?\b(?P<where>[^.,;!?]*)(?P<rest>.*)$",
    re.IGNORECASE | re.DOTALL,
)
_REMEDY = re.compile(r"\b(?:slow|fast|quick|gent|pace|speed|hurry|easy|calm|soft|careful)", re.IGNORECASE)


def _complained(found: re.Match[str]) -> str:
    """What is to be done about a speed that somebody complains of: what they say themselves, or the opposite of it."""
    rest = found["rest"].lstrip(" .,;!?")
    if found["who"].lower() != "you" and found["form"] not in ("s", "es", "ing"):
        return found[0]  # "that crawl space"
    if found["how"]:
        return found["lead"] + rest if rest else found[0]
    if _REMEDY.search(rest) and not re.search(r"\bthere\b", rest, re.IGNORECASE):
        return found["lead"] + rest
    return f"{found['lead']}{'slower' if found['fast'] else 'faster'}{found['where']}{found['rest']}"


def plainer(text: str, scene: Scene) -> str:
    """An utterance with plain words for turns of phrase, and "and" for an "or" between two objects.

    Args:
        text: As it was said or typed.
        scene: With the names of objects.
    """
    for said, meant in _SAID:
        text = said.sub(meant, text)
    text = _numbered(_COMPLAINT.sub(_complained, text), scene)
    for loosely, one, meant in _about_names() if scene.names else ():
        if loosely.search(text):  # the patterns of a scene's names are many, and take long to compile
            text = re.sub(one.replace("%s", _names(scene)), meant, text, flags=re.IGNORECASE)
    return text


@cache
def _about_names() -> tuple[tuple[re.Pattern[str], str, str], ...]:
    """The turns of phrase about objects, each with a pattern that takes anything for their names."""
    return tuple((re.compile(one.replace("%s", r"\S.*?"), re.IGNORECASE), one, meant) for one, meant in _NAMED)


_COUNTS = ("one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")


def _numbered(text: str, scene: Scene) -> str:
    """An utterance with the names of objects that are numbered: "the second pylon", "pylons 1 and 2"."""
    names = {name.lower() for name in scene.names}
    for kind in {name.rpartition(" ")[0] for name in names if name[-1:].isdigit() and " " in name}:
        text = _counted(text, kind, names)
    for number, word in enumerate(("first", "second", "third", "fourth", "fifth"), 1):
        for kind in {name.rpartition(" ")[0] for name in names if name.endswith(f" {number}")} - {""}:
            said = rf"\b(?:the )?{word} {re.escape(kind)}\b(?! \d)"
            text = text if f"{word} {kind}" in names else re.sub(said, f"{kind} {number}", text, flags=re.IGNORECASE)
    return text


def _counted(text: str, kind: str, names: Container[str]) -> str:
    """An utterance with the names of objects of a kind whose numbers are words, or stand in a list or further on."""
    for number, word in enumerate(_COUNTS, 1):
        if f"{kind} {number}" in names and f"{kind} {word}" not in names:
            text = re.sub(rf"\b{re.escape(kind)} {word}\b", f"{kind} {number}", text, flags=re.IGNORECASE)
    pair = rf"\b{re.escape(kind)}s? (?P<one>\d+),? (?P<and>and|or) (?P<two>\d+)(?! ?{_UNIT}\b)\b"
    text = re.sub(pair, rf"{kind} \g<one> \g<and> {kind} \g<two>", text, flags=re.IGNORECASE)
    same = rf"(?P<more>[^.;]*?),? (?:it|that)(?:'s| is) {re.escape(kind)} (?P<n>\d+)"
    named = rf"\b(?:the|our|my|that) {re.escape(kind)}\b(?! \d){same}"
    return re.sub(named, rf"{kind} \g<n>\g<more>", text, flags=re.IGNORECASE)


def without_cargo(text: str, scene: Scene) -> str:
    """An utterance without words that are no objects though their names have them: "carry the vial" beside a vial rack.

    Args:
        text: As it was said or typed.
        scene: With the names of objects.
    """
    last = {head_of(name.lower().split()) for name in scene.names}
    for word in sorted({word.lower() for name in scene.names for word in name.split()[:-1] if len(word) > 2} - last):
        whole = "|".join(re.escape(name) for name in scene.names if word in name.lower().split())
        carried = rf"\b(?P<verb>{_HOLD}) (?:the|my|our) (?!(?:{whole})\b){re.escape(word)}\b"
        text = re.sub(carried, r"\g<verb> it", text, flags=re.IGNORECASE)
        # as a verb: "paint slower" beside a paint pot
        done = rf"^(?P<lead>\W*(?:please )?){re.escape(word)} (?={_MUCH}(?:slow|fast|quick|gentl|careful|more|less))"
        text = re.sub(done, r"\g<lead>", text, flags=re.IGNORECASE)
    named = {word.lower() for name in scene.names for word in name.split()}
    for verbs, things in ((rf"(?:{_HOLD}|raise|lower)", MOUNTED), ("(?:carry|bring|hold|transport)", CARRIED)):
        unknown = "|".join(sorted(things - named))
        text = re.sub(rf"\b(?P<verb>{verbs}) (?:the|my|our) (?:{unknown})\b", r"\g<verb> it", text, flags=re.IGNORECASE)
    return text


MOUNTED = frozenset("camera tray brush nozzle tool sensor probe lens pen pencil scanner sprayer payload load".split())
CARRIED = frozenset(
    "glass cup mug plate bowl spoon fork vial bottle jar box parcel package tea coffee soup food".split()
)
"""What a robot has at its end, and what it carries, where the scene has no object of that name."""

_HOLD = r"(?:carry|bring|hold|lift|transport|keep|put|set|place)"


_AS_NOW = re.compile(
    rf"\b(?:instead of|rather than) (?:the )?(?:{_N}|{_WORD})(?: ?{_UNIT})?(?!\w|\.\d)(?: {_NOW})?", re.IGNORECASE
)


_THE_SAME = re.compile(
    r"^\W*(?:please )?(?:do |go |fly |drive |run |make )?(?:exactly |just )?the same(?: \w+)?,? but ", re.IGNORECASE
)

_LEFT_THERE = re.compile(r"\b(?:leave|drop)\b", re.IGNORECASE)  # where that is tells where the path ends


_OLD = re.compile(
    r"\bthe (?:old|previous|current|present|former) (?=(?:goal|end|end ?point|destination|start|finish)\b)",
    re.IGNORECASE,
)
_TOO_FAR = re.compile(r"\btoo far (?:over |out )?(?:to the )?(?P<way>left|right)\b", re.IGNORECASE)


def without_now(text: str, scene: Scene) -> str:
    """A first instruction without what it says of how things are: "wait 10 seconds instead of 3", "at A, not at B".

    Args:
        text: As it was said or typed.
        scene: With the names of objects.
    """
    text = _THE_SAME.sub("", _AS_NOW.sub("", text))
    text = _OLD.sub("the ", text)
    text = _TOO_FAR.sub(lambda found: f"further {'right' if found['way'].lower() == 'left' else 'left'}", text)
    if len(scene) < 2 or _LEFT_THERE.search(text):
        return text
    name = _names(scene)
    contrast = rf"(?P<one>{name}),? (?:instead of|rather than|(?:and )?not)(?: {_AT}| to| past| round| around)? {name}"
    return re.sub(contrast, r"\g<one>", text, flags=re.IGNORECASE)


def _names(scene: Scene) -> str:
    """A pattern of the objects' names and each of their longer words, with an article."""
    names = {*scene.names, *(word for name in scene.names for word in name.split() if len(word) > 2)}
    return rf"(?:(?:the|my|our|his|her|your) )?(?:{'|'.join(sorted(map(re.escape, names), key=len, reverse=True))})\b"


_PASSED_IT = re.compile(
    r"\b(pass|passing|past|near|by|around|over|under|beside|behind|next to|close to) it\b", re.IGNORECASE
)


_THERE = re.compile(
    r"(?P<do>\b(?:wait|stop|pause|hover|hold|stay|slower|faster|higher|lower|slow down|speed up|closer)\b[^.,;!?]*?) "
    r"there\b(?! (?:is|are|was|were)\b)",
    re.IGNORECASE,
)


def with_place(text: str, place: str, scene: Scene) -> str:
    """An utterance with a place for its "there", unless it names an object itself: "wait there for 3 seconds"."""
    if any(word.lower() in text.lower() for word in (*scene.names, "instead", "not ", "only")):
        return text
    return _THERE.sub(lambda found: f"{found['do']} {place}", text)


_THING = re.compile(r"\b(?:(?:the|that|this) (?:thing|object|one)|that|it)\b", re.IGNORECASE)


def with_thing(text: str, name: str) -> tuple[str, ...]:
    """An utterance with the name of the thing that it left open, in its place and at its end."""
    asked = text.rstrip(" .!?")
    return (_THING.sub(f"the {name}", asked, count=1), f"{asked} the {name}", f"{asked} from the {name}")


def with_name(text: str, name: str, scene: Scene) -> str:
    """An utterance with a name for an "it" that is a thing, not the path: "slower while you pass it".

    It stays as it is where it names an object itself.
    """
    if any(known.lower() in text.lower() for known in scene.names):
        return text
    return _PASSED_IT.sub(rf"\1 the {name}", text)
