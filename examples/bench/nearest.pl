#!/usr/bin/env perl
# Answers with the image to learn from whose samples are most like those of the window, and with its class.
use strict;
use warnings;
use JSON::PP;

$| = 1;
my $header = decode_json(scalar <STDIN>);
my ($images, $labels) = @{ $header->{learn} }{qw(images labels)};
while (my $line = <STDIN>) {
    my $window = decode_json($line);
    my ($best, $most) = (0, -1e300);
    for my $k (0 .. $#$images) {
        my ($product, $square) = (0, 1e-300);
        for my $i (0 .. $window->{m} - 1) {
            my ($sum, $taxel) = (0, 0);
            my $row = $window->{phi}[$i];
            # signs, or numbers where some are 0
            $sum += $_ * $images->[$k][$taxel++] for ref $row ? @$row : map { $_ eq '+' ? 1 : -1 } split //, $row;
            $product += $sum * $window->{y}[$i];
            $square  += $sum**2;
        }
        ($best, $most) = ($k, $product / sqrt $square) if $product / sqrt $square > $most;
    }
    print encode_json({ image => $images->[$best], label => $labels->[$best] }), "\n";
}
