"""What a cause is called: the mistake in words, and one next step."""

from __future__ import annotations

from collections.abc import Mapping

#: What a cause is called, by its first word: (mistake, advice). {name} is the result, {of} what follows ":".
WORDS: Mapping[str, tuple[str, str]] = {
    "zeros": (
        "Your {name} is zero.",
        "Look for a variable that is born as a whole number, or as zero and never changed.",
    ),
    "constant": (
        "Your {name} is the same for all inputs{of}.",
        "Look which of the arguments your formula uses: the right answer changes with them.",
    ),
    "nan": (
        "Your {name} is not a finite number.",
        "Find the division by zero, or the root of a negative number, and say what should happen there.",
    ),
    "singular": (
        "Your {name} is huge or not finite nearly everywhere: a singular matrix has been inverted, or zero divided by.",
        "Look at what you invert or divide by: on paper it must not be zero.",
    ),
    "negated": (
        "Your {name} is the right one with the opposite sign.",
        "Look at the signs, and at the order in differences and cross products.",
    ),
    "transposed": (
        "Your {name} is the right one transposed: rows and columns are exchanged.",
        "Write down what one row of the result means, and what one column does. Then compare.",
    ),
    "negated and transposed": (
        "Your {name} is the right one transposed, with the opposite sign.",
        "Write down what one row and one column of the result mean, then look at the signs.",
    ),
    "permuted": (
        "Your {name} has the right numbers in another order ({of}).",
        "Read in the docstring which component comes first.",
    ),
    "rows permuted": (
        "Your {name} has the right rows in another order ({of}).",
        "Read in the docstring which row is which.",
    ),
    "columns permuted": (
        "Your {name} has the right columns in another order ({of}).",
        "Read in the docstring which column is which.",
    ),
    "scaled": (
        "Your {name} is {of} times the right one.",
        "Look for a constant factor: one that is missing, or one too many.",
    ),
    "absolute": (
        "Your {name} is the absolute value of the right one: it is never negative.",
        "Find where the sign is lost: a length, a square, an absolute value.",
    ),
    "clamped": (
        "Your {name} is right, but negative values are replaced by zero.",
        "Return the true values, negative ones too.",
    ),
    "whole numbers": (
        "Your {name} is the right one cut to whole numbers.",
        "A variable keeps the type it is born with: write 0.0 where you wrote 0.",
    ),
    "normalised": (
        "Your {name} points the right way, but has been made of length one.",
        "Its length means something here: do not normalise it.",
    ),
    "rows normalised": (
        "The rows of your {name} point the right way, but have been made of length one.",
        "Their lengths mean something here: do not normalise them.",
    ),
    "squared": (
        "Your {name} is the square of the right one, entry by entry.",
        "Take out the square, or put in the root.",
    ),
    "root": (
        "Your {name} is the square root of the right one, entry by entry.",
        "Take out the root: look at the powers in the formula.",
    ),
    "inverse": (
        "Your {name} is the inverse of the right one.",
        "Ask what goes in and what comes out of this matrix: you have the way back.",
    ),
    "symmetrised": (
        "Your {name} is the symmetric part of the right one.",
        "The right answer need not be symmetric: do not add its transpose.",
    ),
    "diagonal only": (
        "Your {name} has the right diagonal, and zeros elsewhere.",
        "Work out an entry off the diagonal by hand.",
    ),
    "upper triangle only": (
        "Your {name} is right on and above the diagonal, and zero below.",
        "Fill the other half, too.",
    ),
    "lower triangle only": (
        "Your {name} is right on and below the diagonal, and zero above.",
        "Fill the other half, too.",
    ),
    "change scaled": (
        "What your formula changes is {of} times what it should change.",
        "Look at the factor of the term you add or take away.",
    ),
    "echo": (
        "Your {name} is just the argument {of}.",
        "Check that what you return is the result, and not the argument you began with.",
    ),
    "turned": (
        "Your {name} is just the argument {of}, with the opposite sign.",
        "Check that what you return is the result, and not the argument you began with.",
    ),
    "lacks": (
        "Your {name} lacks exactly {of}: add it, and it is right.",
        "Look where {of} should come in, with factor one.",
    ),
    "plus": (
        "Your {name} is the right one plus {of}.",
        "Look where {of} comes in once too often.",
    ),
    "digits": (
        "Your {name} is nearly right, but only to some digits.",
        "Look for a rounded constant, a number converted to f32, a small one added to what you divide by.",
    ),
    "differences": (
        "Your {name} is nearly right, but only to some digits, as by differences with a small step: {of}.",
        "A formula is asked for, not a numerical derivative. If yours is one, look for rounded constants.",
    ),
    "rounding": (
        "Your {name} is nearly right, but only to some digits: {of}.",
        "Look where it takes differences of large numbers, and for rounded constants.",
    ),
    "missing": (
        "It looks as if {of} were missing in your {name}.",
        "Compare with the formula, and find the place of {of}.",
    ),
    "missing factor": (
        "Your {name} is right when it is multiplied by {of}: that is missing, or has been divided by once too often.",
        "Check the unit of your result against the one in the docstring.",
    ),
    "extra": (
        "Your {name} is right when it is divided by {of}: that comes in once too often, or has not been divided by.",
        "Check the unit of your result against the one in the docstring.",
    ),
    "copy": (
        "Your {name} repeats {of}.",
        "Look at the indices: one of them says the same twice.",
    ),
    "between 0 and 1": (
        "Your {name} is right, but kept between 0 and 1.",
        "Return the true values, those below 0 and above 1 too.",
    ),
    "powers": (
        "Your {name} is right up to a factor that grows like {of}.",
        "Check the unit of your result: which powers of these quantities should be in it?",
    ),
    "swapped": (
        "Your {name} is what one gets with {of} exchanged.",
        "Follow both through your formula, and mind the order of the arguments.",
    ),
    "rolled": (
        "Your {name} is what one gets with {of} moved on by one place.",
        "Check the numbers of the vertices, one by one.",
    ),
    "transposed argument": (
        "Your {name} is what one gets with {of} transposed.",
        "Compare with the formula: what is transposed there, and what is not?",
    ),
    "negated argument": (
        "Your {name} is what one gets with {of} turned round.",
        "Look at the sign of the term with {of}.",
    ),
    "doubled": (
        "Your {name} is what one gets with twice {of}.",
        "Look at the constant factor of the term with {of}.",
    ),
    "halved": (
        "Your {name} is what one gets with half of {of}.",
        "Look at the constant factor of the term with {of}.",
    ),
    "squared argument": (
        "Your {name} is what one gets with the square of {of}.",
        "Look at the powers of {of} in the formula.",
    ),
    "normalised argument": (
        "Your {name} is what one gets with {of} made of length one.",
        "The length of {of} means something here: use it as it comes.",
    ),
    "diagonal argument": (
        "Your {name} uses no more than the diagonal of {of}.",
        "Multiply with the whole matrix {of}, not entry by entry.",
    ),
    "permuted argument": (
        "Your {name} is what one gets with the components of {of} in another order.",
        "Check which component of {of} belongs where.",
    ),
    "ignored": (
        "Your {name} does not depend on {of}.",
        "Work the same example by hand for two values of {of}: what changes?",
    ),
    "shifted": (
        "Your {name} is the one that belongs to another {of}.",
        "Draw the triangle and number it: which {of} does your formula belong to?",
    ),
    "in a plane": (
        "Your {name} is right only for triangles in the plane z = 0: the third coordinate is not used.",
        "Try a triangle that stands upright: the cloth lives in space.",
    ),
    "factor": (
        "Your {name} is right up to a factor that differs from case to case: the direction is right, not the size.",
        "Look at what your formula is divided by or multiplied with: a length, an area.",
    ),
    "row": ("Only row {of} of your {name} is wrong.", "Look at how row {of} is made; leave the others."),
    "column": (
        "Only column {of} of your {name} is wrong.",
        "Look at how column {of} is made; leave the others.",
    ),
    "component": (
        "Only component {of} of your {name} is wrong.",
        "Look at how component {of} is made; leave the others.",
    ),
    "components": (
        "Only the components {of} of your {name} are wrong.",
        "Look at how the components {of} are made; leave the others.",
    ),
    "entry": ("Only entry {of} of your {name} is wrong.", "Look at how this one entry is made."),
    "diagonal": (
        "Only the diagonal of your {name} is wrong.",
        "Look at the entries on the diagonal; the others are right.",
    ),
    "off the diagonal": (
        "Only the entries off the diagonal of your {name} are wrong.",
        "Look at the entries off the diagonal; the diagonal is right.",
    ),
    "third row and column": (
        "Only the third row and column of your {name} are wrong.",
        "Read in the docstring what belongs there.",
    ),
    "where": (
        "Your {name} is wrong where {of}, and right everywhere else.",
        "Work one such case by hand: what is different there?",
    ),
}
